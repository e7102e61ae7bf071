#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <memory>
#include <numbers>

#include "fixtures/solids.h"
#include "input/hull_queries.h"
#include "relax/build_barrier.h"
#include "relax/cell_moments.h"
#include "unit/relax/relax_fixtures.h"

namespace amhex {
namespace {

HullBarrier BarrierOf(const Hull& hull, double points_per_site) {
  RunContext run;
  absl::StatusOr<HullBarrier> barrier = BuildHullBarrier(hull, points_per_site, 1.0, run);
  EXPECT_TRUE(barrier.ok()) << barrier.status();
  return *std::move(barrier);
}

double InsideVolume(const HullBarrier& barrier) {
  int64_t points = 0;
  for (const int32_t side : barrier.tile_side) points += side == kTileInside ? kTilePoints : 0;
  for (const uint32_t word : barrier.inside_mask) points += CountBits(word);
  return static_cast<double>(points) * barrier.lattice.point_volume();
}

void ExpectWindingNumbers(const TriangleMesh& solid) {
  const Hull hull = testing_support::HullOfMesh(solid);
  const HullBarrier barrier = BarrierOf(hull, 30);
  const FccLattice& lattice = barrier.lattice;
  for (int64_t tile = 0; tile < lattice.tile_count(); ++tile) {
    const LatticePoint base = lattice.TileOrigin(tile);
    for (int k = 0; k < kTilePoints; ++k) {
      const LatticePoint b = BlockInTile(k / kBlockPoints), p = PointInBlock(k % kBlockPoints);
      const Vec3d at =
          lattice.PositionOf({base.x + b.x + p.x, base.y + b.y + p.y, base.z + b.z + p.z});
      ASSERT_EQ(barrier.View().IsInside(at), hull.queries->IsInside(barrier.origin + at))
          << "tile " << tile << " point " << k;
    }
  }
}

TEST(HullBarrier, EqualsTheWindingNumberAtEveryLatticePoint) {
  ExpectWindingNumbers(fixtures::MakeTorus(2.37, 0.81, 0.5));
  ExpectWindingNumbers(fixtures::MakeTwistedBox({2, 2, 4}, 1.2, 0.7));
  ExpectWindingNumbers(fixtures::MakeBracket(1.7, 0.9));
}

TEST(HullBarrier, SeesCavities) {
  ExpectWindingNumbers(fixtures::Joined(fixtures::MakeSphere(2.5, 0.7),
                                        fixtures::Flipped(fixtures::MakeSphere(1.2, 0.5))));
}

TEST(HullBarrier, HoldsTheVolumeOfTheSolid) {
  const HullBarrier box =
      BarrierOf(testing_support::HullOfMesh(fixtures::MakeBox({3, 4, 5}, 1)), 108);
  EXPECT_NEAR(InsideVolume(box), 60, 1e-9);
  const Hull sphere = testing_support::HullOfMesh(fixtures::MakeSphere(3, 0.3));
  EXPECT_NEAR(InsideVolume(BarrierOf(sphere, 108)) / sphere.volume, 1, 0.005);
}

TEST(HullBarrier, RowsThroughVerticesAndEdgesCloseLikeAnyOther) {
  // A box whose vertices lie on lattice rows: corners shifted by half a lattice step.
  const double spacing = std::cbrt(0.5 / 108);
  TriangleMesh box = fixtures::MakeBox({3, 3, 3}, 0.5);
  for (Vec3d& v : box.vertices) v = v * (spacing * 6) + Vec3d{0.1, 0.2, 0.3};
  Hull hull = testing_support::HullOfMesh(box);
  // The box is what anchors the lattice; widening it moves the rows onto the vertices.
  hull.box.low = hull.box.low - Vec3d{0.5, 0.5, 0.5} * spacing;
  const HullBarrier barrier = BarrierOf(hull, 108);
  EXPECT_NEAR(InsideVolume(barrier), std::pow(18 * spacing, 3), 1e-6);
}

TEST(HullBarrier, ACrackedHullIsJudgedByItsWindingNumber) {
  Hull hull = testing_support::HullOfMesh(fixtures::MakeBox({4, 4, 4}, 0.5));
  // A hole in the side that every row leaves through.
  size_t lost = 0;
  while (hull.triangle_normals[lost].x < 0.9) ++lost;
  hull.triangles.erase(hull.triangles.begin() + static_cast<std::ptrdiff_t>(lost));
  hull.queries = std::make_shared<HullQueries>(hull.vertices, hull.triangles);
  EXPECT_NEAR(InsideVolume(BarrierOf(hull, 108)), 64, 0.5);
}

TEST(HullBarrier, ABoxAbsurdlyLargerThanItsLatticeIsRefused) {
  TriangleMesh box = fixtures::MakeBox({1, 1, 1}, 1);
  for (Vec3d& v : box.vertices) v = v * 1e5;
  RunContext run;
  EXPECT_EQ(BuildHullBarrier(testing_support::HullOfMesh(box), 108, 1.0, run).status().code(),
            absl::StatusCode::kResourceExhausted);
}

TEST(LabelItems, CoverEveryInsidePointOnce) {
  const Hull hull = testing_support::HullOfMesh(fixtures::MakeTorus(3, 1, 0.5));
  const HullBarrier barrier = BarrierOf(hull, 50);
  std::vector<int> seen(barrier.tile_side.size(), 0);
  for (const LabelItem& item : ListLabelItems(barrier, {})) {
    EXPECT_EQ(item.is_inside, 1);
    ++seen[static_cast<size_t>(item.tile)];
  }
  for (size_t tile = 0; tile < seen.size(); ++tile) {
    EXPECT_EQ(seen[tile], barrier.tile_side[tile] == kTileOutside ? 0 : 1);
  }
}

}  // namespace
}  // namespace amhex
