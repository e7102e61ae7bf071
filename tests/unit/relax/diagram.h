// Sites in a solid and everything that one labelling of them needs, with brute force beside it.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/array_view_of.h"
#include "exec/cpu_executor.h"
#include "graph/grid_bins.h"
#include "relax/build_barrier.h"
#include "relax/label_body.h"
#include "unit/graph/random_points.h"
#include "unit/relax/relax_fixtures.h"

namespace amhex {

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
    SiteMetricBody{barrier.lattice.spacing, ArrayViewOf(first), ArrayViewOf(at), ArrayViewOf(frame),
                   ArrayViewOf(extent),     ArrayViewOf(side),  {&m, 1}}(0);
    metric.push_back(m);
    position.push_back(ToFloat(p));
    for (int axis = 0; axis < 3; ++axis) largest_size = Larger(largest_size, size[axis]);
  }

  // Calls label(body) with a body that is ready to run on this diagram's items.
  template <class LabelWith>
  void LabelBy(const LabelWith& label) {
    CpuExecutor executor;
    GridBins<CpuExecutor> bins(executor, barrier.extent, 1.0f);
    moments.assign(metric.size(), CellMoments{});
    labels.assign(items.size() * kTilePoints, kNoOwner);
    LabelTileBody body;
    body.barrier = barrier.View();
    body.items = ArrayViewOf(items);
    body.bins = bins.Build(ArrayViewOf(position), static_cast<int64_t>(position.size()));
    std::vector<SiteMetric> by_slot;
    for (size_t slot = 0; slot < metric.size(); ++slot) {
      by_slot.push_back(metric[static_cast<size_t>(body.bins.ids[static_cast<int64_t>(slot)])]);
    }
    body.metric = ArrayViewOf(by_slot);
    body.largest_size = largest_size;
    body.wants_second_moments = true;
    body.moments = {moments.data(), static_cast<int64_t>(moments.size())};
    body.labels = {labels.data(), static_cast<int64_t>(labels.size())};
    label(body);
  }

  void Label() {
    LabelBy([&](const LabelTileBody& body) {
      CpuExecutor().ForEach("label", static_cast<int64_t>(items.size()), body);
    });
  }

  // Of point `p` of the block at `base`.
  int32_t BruteForceOwner(const LabelItem& item, const LatticePoint& base, int p) const {
    const Vec3f centre = CentreOfCube(base, kBlockHalfWidth);
    float nearest = item.is_inside != 0 ? kUnboundedReach : kOutsideReach;
    int32_t owner = kNoOwner;
    for (size_t i = 0; i < metric.size(); ++i) {
      if (!metric[i].IsOfSide(item.is_inside)) continue;
      const float d = ChebyshevDistance(metric[i], centre, StepFromCentre(p));
      if (d < nearest) {
        nearest = d;
        owner = static_cast<int32_t>(i);
      }
    }
    return owner;
  }
};

inline Diagram DiagramIn(const TriangleMesh& solid, double points_per_site) {
  RunContext run;
  Diagram diagram;
  diagram.barrier =
      *BuildHullBarrier(testing_support::HullOfMesh(solid), points_per_site, 2.0, run);
  return diagram;
}

inline void AddRandomSites(Diagram& diagram, uint64_t seed, int count, float size_spread) {
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

inline void ExpectBruteForceLabels(const Diagram& diagram) {
  const BarrierView barrier = diagram.barrier.View();
  int64_t owned_points = 0;
  for (size_t i = 0; i < diagram.items.size(); ++i) {
    const LabelItem& item = diagram.items[i];
    const LatticePoint tile = diagram.barrier.lattice.TileOrigin(item.tile);
    for (int k = 0; k < kTilePoints; ++k) {
      const LatticePoint b = BlockInTile(k / kBlockPoints), p = PointInBlock(k % kBlockPoints);
      const LatticePoint base = {tile.x + b.x, tile.y + b.y, tile.z + b.z};
      const LatticePoint q = {base.x + p.x, base.y + p.y, base.z + p.z};
      const bool is_inside = barrier.IsInside(diagram.barrier.lattice.PositionOf(q));
      const int32_t expected = is_inside == (item.is_inside != 0)
                                   ? diagram.BruteForceOwner(item, base, k % kBlockPoints)
                                   : kNoOwner;
      ASSERT_EQ(diagram.labels[i * kTilePoints + static_cast<size_t>(k)], expected)
          << "item " << i << " point " << k;
      owned_points += expected != kNoOwner ? 1 : 0;
    }
  }
  int64_t summed = 0;
  for (const CellMoments& m : diagram.moments) summed += m.count;
  EXPECT_EQ(summed, owned_points);
}

}  // namespace amhex
