#include "input/site_grid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fixtures/solids.h"
#include "input/hull_queries.h"
#include "unit/relax/relax_fixtures.h"

namespace amhex {
namespace {

absl::StatusOr<Sites> Populate(const TriangleMesh& solid, Initialization initialization,
                               uint64_t seed = 1) {
  MeshingParams params;
  params.relaxation.initialization = initialization;
  params.run.seed = seed;
  const Hull hull = testing_support::HullOfMesh(solid);
  RunContext run;
  return PopulateGrid(hull, SamplesOf(hull), params, run);
}

TEST(SiteGrid, FillsABoxWithOneSitePerUnitCube) {
  const Hull hull = testing_support::HullOfMesh(fixtures::MakeBox({3, 4, 5}, 0.5));
  const auto sites = Populate(fixtures::MakeBox({3, 4, 5}, 0.5), Initialization::kGrid);
  ASSERT_TRUE(sites.ok()) << sites.status();
  int inside = 0;
  for (const Vec3d& p : sites->position) {
    if (!hull.queries->IsInside(p)) continue;
    ++inside;
    EXPECT_NEAR(p.x - std::floor(p.x), 0.5, 1e-12);
  }
  EXPECT_EQ(inside, 60);
}

TEST(SiteGrid, KeepsOutsideSitesWithinOneHopOfTheHullOnly) {
  const TriangleMesh box = fixtures::MakeBox({4, 4, 4}, 0.4);
  const Hull hull = testing_support::HullOfMesh(box);
  const auto sites = Populate(box, Initialization::kGrid);
  ASSERT_TRUE(sites.ok());
  int first_layer = 0;
  for (const Vec3d& p : sites->position) {
    const double distance = hull.queries->SignedDistance(p);
    EXPECT_LT(distance, 1.25);
    if (distance > 0 && distance < 0.6) ++first_layer;
  }
  EXPECT_EQ(first_layer, 6 * 16);
}

TEST(SiteGrid, EqualsTheWindingNumberOfEveryCube) {
  // Wide enough for cubes that are judged in groups, inside and outside.
  const TriangleMesh torus = fixtures::MakeTorus(14, 7.5, 1.5);
  const Hull hull = testing_support::HullOfMesh(torus);
  const auto sites = Populate(torus, Initialization::kGrid);
  ASSERT_TRUE(sites.ok());
  int64_t found = 0;
  for (const Vec3d& p : sites->position) found += hull.queries->IsInside(p) ? 1 : 0;
  const Vec3d first = sites->position[0];
  int64_t expected = 0;
  for (int z = -40; z <= 40; ++z) {
    for (int y = -60; y <= 60; ++y) {
      for (int x = -60; x <= 60; ++x) {
        const Vec3d p = {first.x + x, first.y + y, first.z + z};
        const Box3d& b = hull.box;
        if (p.x < b.low.x || p.y < b.low.y || p.z < b.low.z) continue;
        if (p.x > b.high.x || p.y > b.high.y || p.z > b.high.z) continue;
        expected += hull.queries->IsInside(p) ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(found, expected);
}

TEST(SiteGrid, JitterMovesSitesByItsAmountAndFollowsTheSeed) {
  const TriangleMesh sphere = fixtures::MakeSphere(4, 0.5);
  const auto one = Populate(sphere, Initialization::kJitteredGrid, 1);
  const auto again = Populate(sphere, Initialization::kJitteredGrid, 1);
  const auto other = Populate(sphere, Initialization::kJitteredGrid, 2);
  ASSERT_TRUE(one.ok() && again.ok() && other.ok());
  EXPECT_EQ(one->position, again->position);
  EXPECT_NE(one->position, other->position);
  for (const Vec3d& p : one->position) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_LE(std::abs(p[axis] - (std::floor(p[axis]) + 0.5)), 0.2 + 1e-12);
    }
  }
}

TEST(SiteGrid, SaysWhenEverythingIsThinnerThanTheEdgeLength) {
  const auto sites = Populate(fixtures::MakeBox({3, 3, 1e-6}, 0.5), Initialization::kJitteredGrid);
  // The middle layer of sites lies in the sheet's plane; jitter moves every one of them out.
  EXPECT_EQ(sites.status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(SiteGrid, RefusesBoxesAbsurdlyLargerThanTheEdgeLength) {
  TriangleMesh box = fixtures::MakeBox({1, 1, 1}, 1);
  for (Vec3d& v : box.vertices) v = v * 1e6;
  const auto sites = Populate(box, Initialization::kGrid);
  EXPECT_EQ(sites.status().code(), absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace amhex
