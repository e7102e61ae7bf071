#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <vector>

#include "exec/cpu_executor.h"
#include "fixtures/solids.h"
#include "graph/point_bins.h"
#include "relax/build_barrier.h"
#include "relax/label_body.h"
#include "unit/graph/random_points.h"
#include "unit/relax/relax_fixtures.h"

namespace amhex {
namespace {

template <class T>
ArrayView<const T> ViewOf(const std::vector<T>& v) {
  return {v.data(), static_cast<int64_t>(v.size())};
}

// Everything that one labelling needs; sites in the domain frame.
struct Diagram {
  HullBarrier barrier;
  std::vector<LabelItem> items;
  std::vector<SiteMetric> metric;
  std::vector<Vec3f> position;
  float largest_size = 0;
  std::vector<CellMoments> moments;
  std::vector<int32_t> labels;

  void AddSite(const Vec3d& p, const Quatf& orientation, const Vec3f& size, bool is_inside) {
    const std::vector<Vec3d> at = {p};
    const std::vector<Quatf> frame = {orientation};
    const std::vector<Vec3f> extent = {size};
    const std::vector<int32_t> side = {is_inside ? 1 : 0};
    const std::vector<int32_t> first = {0};
    SiteMetric m;
    SiteMetricBody{
        ViewOf(first), ViewOf(at), ViewOf(frame), ViewOf(extent), ViewOf(side), {&m, 1}}(0);
    metric.push_back(m);
    position.push_back(ToFloat(p));
    for (int axis = 0; axis < 3; ++axis) largest_size = Larger(largest_size, size[axis]);
  }

  void Label() {
    CpuExecutor executor;
    PointBins<CpuExecutor> bins(executor, barrier.extent, 1.0f);
    moments.assign(metric.size(), CellMoments{});
    labels.assign(items.size() * kTilePoints, kNoOwner);
    LabelTileBody body;
    body.barrier = barrier.View();
    body.items = ViewOf(items);
    body.bins = bins.Build(ViewOf(position), static_cast<int64_t>(position.size()));
    std::vector<SiteMetric> by_slot;
    for (size_t slot = 0; slot < metric.size(); ++slot) {
      by_slot.push_back(metric[static_cast<size_t>(body.bins.ids[static_cast<int64_t>(slot)])]);
    }
    body.metric = ViewOf(by_slot);
    body.largest_size = largest_size;
    body.wants_second_moments = true;
    body.moments = {moments.data(), static_cast<int64_t>(moments.size())};
    body.labels = {labels.data(), static_cast<int64_t>(labels.size())};
    executor.ForEach("label", static_cast<int64_t>(items.size()), body);
  }

  int32_t BruteForceOwner(const LabelItem& item, const LatticePoint& q) const {
    const Vec3f p = ToFloat(barrier.lattice.PositionOf(q));
    float nearest = item.is_inside != 0 ? kUnboundedReach : kOutsideReach;
    int32_t owner = kNoOwner;
    for (size_t i = 0; i < metric.size(); ++i) {
      if (metric[i].is_inside != item.is_inside) continue;
      const float d = ChebyshevDistance(metric[i], p);
      if (d < nearest) {
        nearest = d;
        owner = static_cast<int32_t>(i);
      }
    }
    return owner;
  }
};

Diagram DiagramIn(const TriangleMesh& solid, double points_per_site) {
  RunContext run;
  Diagram diagram;
  diagram.barrier =
      *BuildHullBarrier(testing_support::HullOfMesh(solid), points_per_site, 2.0, run);
  return diagram;
}

void AddRandomSites(Diagram& diagram, uint64_t seed, int count, float size_spread) {
  const std::vector<Vec3f> unit = RandomPoints(seed, count, 1);
  const std::vector<Vec3f> turns = RandomPoints(seed + 1, count, 1);
  const BarrierView barrier = diagram.barrier.View();
  std::vector<Vec3d> outside;
  for (size_t i = 0; i < unit.size(); ++i) {
    const Vec3d e = diagram.barrier.extent;
    const Vec3d p = {unit[i].x * e.x, unit[i].y * e.y, unit[i].z * e.z};
    const Quatf q =
        Normalized(Quatf{1, 4 * turns[i].x - 2, 4 * turns[i].y - 2, 4 * turns[i].z - 2});
    const Vec3f size = Vec3f{1, 1, 1} + turns[i] * size_spread;
    const bool is_inside = barrier.IsInside(p);
    if (!is_inside) outside.push_back(p);
    diagram.AddSite(p, q, size, is_inside);
  }
  diagram.items = ListLabelItems(diagram.barrier, outside);
}

void ExpectBruteForceLabels(const Diagram& diagram) {
  const BarrierView barrier = diagram.barrier.View();
  int64_t owned_points = 0;
  for (size_t i = 0; i < diagram.items.size(); ++i) {
    const LabelItem& item = diagram.items[i];
    const LatticePoint tile = diagram.barrier.lattice.TileOrigin(item.tile);
    for (int k = 0; k < kTilePoints; ++k) {
      const LatticePoint b = BlockInTile(k / kBlockPoints), p = PointInBlock(k % kBlockPoints);
      const LatticePoint q = {tile.x + b.x + p.x, tile.y + b.y + p.y, tile.z + b.z + p.z};
      const bool is_inside = barrier.IsInside(diagram.barrier.lattice.PositionOf(q));
      const int32_t expected =
          is_inside == (item.is_inside != 0) ? diagram.BruteForceOwner(item, q) : kNoOwner;
      ASSERT_EQ(diagram.labels[i * kTilePoints + static_cast<size_t>(k)], expected)
          << "item " << i << " point " << k;
      owned_points += expected != kNoOwner ? 1 : 0;
    }
  }
  int64_t summed = 0;
  for (const CellMoments& m : diagram.moments) summed += m.count;
  EXPECT_EQ(summed, owned_points);
}

TEST(VoronoiLabels, EqualBruteForceOnRandomSites) {
  Diagram diagram = DiagramIn(fixtures::MakeTorus(3, 1.3, 0.6), 40);
  AddRandomSites(diagram, 1, 700, 0.0f);
  diagram.Label();
  ExpectBruteForceLabels(diagram);
}

TEST(VoronoiLabels, EqualBruteForceForCellsOfDifferentSizes) {
  Diagram diagram = DiagramIn(fixtures::MakeSphere(2.5, 0.6), 100);
  AddRandomSites(diagram, 3, 250, 0.8f);
  diagram.Label();
  ExpectBruteForceLabels(diagram);
}

TEST(VoronoiLabels, EqualBruteForceWhereSitesAreFewOrCrowded) {
  Diagram few = DiagramIn(fixtures::MakeBox({6, 6, 6}, 2), 20);
  AddRandomSites(few, 5, 4, 0.0f);
  few.Label();
  ExpectBruteForceLabels(few);
  // More sites in one tile than the candidate lists hold.
  Diagram crowded = DiagramIn(fixtures::MakeBox({3, 3, 3}, 1), 8);
  AddRandomSites(crowded, 7, 3000, 0.0f);
  crowded.Label();
  ExpectBruteForceLabels(crowded);
}

TEST(VoronoiLabels, UnderMaximumNormAnAlignedGridGivesCubes) {
  // 108 points per site: a unit cube holds 3 x 3 x 3 cells of the lattice.
  Diagram diagram = DiagramIn(fixtures::MakeBox({4, 4, 4}, 1), 108);
  const Vec3d corner = Vec3d{} - diagram.barrier.origin;
  for (int i = 0; i < 64; ++i) {
    diagram.AddSite(corner + Vec3d{i % 4 + 0.5, i / 4 % 4 + 0.5, i / 16 + 0.5}, Quatf{}, {1, 1, 1},
                    true);
  }
  diagram.items = ListLabelItems(diagram.barrier, {});
  diagram.Label();
  const double spacing = diagram.barrier.lattice.spacing;
  for (size_t i = 0; i < 64; ++i) {
    const CellMoments& m = diagram.moments[i];
    ASSERT_EQ(m.count, 108);
    const Vec3d centroid =
        Vec3d{static_cast<double>(m.x), static_cast<double>(m.y), static_cast<double>(m.z)} *
        (spacing / 108);
    EXPECT_NEAR(
        Norm(centroid - Vec3d{diagram.metric[i].x, diagram.metric[i].y, diagram.metric[i].z}), 0,
        1e-5);
  }
}

TEST(CellMoments, DoNotDependOnThreadCount) {
  Diagram diagram = DiagramIn(fixtures::MakeTorus(3, 1.3, 0.6), 60);
  AddRandomSites(diagram, 9, 500, 0.5f);
  const auto label_with = [&](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    diagram.Label();
    return diagram.moments;
  };
  const std::vector<CellMoments> one = label_with(1), four = label_with(4);
  for (size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].count, four[i].count);
    EXPECT_EQ(one[i].x, four[i].x);
    EXPECT_EQ(one[i].xx, four[i].xx);
    EXPECT_EQ(one[i].zx, four[i].zx);
  }
}

}  // namespace
}  // namespace amhex
