// Where a hull is held against a boundary: as densely on fine inputs as on coarse ones, and always
// where it is farthest away.
#include "optimize/hull_samples.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fixtures/solids.h"
#include "optimize/hull_features.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"
#include "support/hull_of_mesh.h"

namespace amhex {
namespace {

constexpr testing_support::GridSize kSampledSize{4, 4, 4};
constexpr double kArea = 6 * 16;

// A box of 4 edge lengths, its corners at `spacing`, as an input.
Hull Box(double spacing) {
  Hull hull = testing_support::GridHull(kSampledSize, spacing);
  hull.input_points = hull.vertices;
  return hull;
}

TEST(HullPoints, AreNoDenserOnFinerInputs) {
  const Hull coarse = Box(1.0), fine = Box(0.1), finest = Box(0.04);
  const auto per_area = [](const Hull& hull) {
    return static_cast<double>(HullPoints(hull, false, {}).Against(*hull.queries, {}).size()) /
           kArea;
  };
  EXPECT_GE(per_area(coarse), 9);
  EXPECT_LT(per_area(fine), 2 * per_area(coarse));
  EXPECT_NEAR(per_area(finest), per_area(fine), 0.1 * per_area(fine));
}

// One corner of the fine box is drawn out to a tip that the boundary does not have.
TEST(HullPoints, HoldTheFarthestOfManyInputPoints) {
  const Hull boundary = Box(1.0);
  TriangleMesh mesh = fixtures::MakeBox({4, 4, 4}, 0.1);
  const auto tip = std::max_element(
      mesh.vertices.begin(), mesh.vertices.end(),
      [](const Vec3d& a, const Vec3d& b) { return a.x + a.y + a.z < b.x + b.y + b.z; });
  *tip += Vec3d{0.6, 0.6, 0.6};
  const Vec3d place = *tip;
  Hull hull = testing_support::HullOfMesh(mesh);
  hull.input_points = hull.vertices;
  const std::vector<Vec3d> points = HullPoints(hull, false, {}).Against(*boundary.queries, {});
  EXPECT_NE(std::find(points.begin(), points.end(), place), points.end());
}

TEST(CreasePoints, AreNoDenserOnFinerInputs) {
  constexpr double kLength = 12 * 4;  // of the edges of the box
  for (const double spacing : {4.0, 1.0, 0.3, 0.1, 0.05}) {
    const Hull hull = Box(spacing);
    const auto count = static_cast<double>(CreasePoints(HullFeatures(hull).view()).size());
    EXPECT_GE(count / kLength, 3.5) << spacing;
    EXPECT_LE(count / kLength, 7) << spacing;
  }
}

}  // namespace
}  // namespace amhex
