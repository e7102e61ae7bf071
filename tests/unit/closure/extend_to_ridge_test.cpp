#include "closure/extend_to_ridge.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "closure/ridges.h"
#include "fixtures/wedges.h"
#include "optimize/cell_quality.h"
#include "support/hull_of_mesh.h"
#include "support/wedge_complex.h"

namespace amhex {
namespace {

using testing_support::GridSize;
using testing_support::HullOfMesh;
using testing_support::WedgeComplex;

constexpr double kDegrees = 20;
constexpr double kBegin = 1.6;
constexpr GridSize kRidgeSize = {4, 5, 2};

Hull WedgeHull(double degrees) {
  return HullOfMesh(fixtures::MakeWedge(degrees, kBegin + kRidgeSize.nx, kRidgeSize.ny));
}

void ExpectHexahedraUpToTheRidge(const WorkingMesh& mesh, const Hull& hull) {
  EXPECT_FALSE(mesh.HasOpenFaces());
  double volume = 0, nearest = 1e9;
  for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
    if (!mesh.alive(cell)) continue;
    EXPECT_TRUE(mesh.is_hexahedron(cell));
    EXPECT_GT(CellQuality(mesh.corners(cell), mesh.vertices()), 0.5);
    volume += CellVolume(mesh.corners(cell), mesh.vertices());
    for (const int32_t v : mesh.corners(cell)) {
      const Vec3d& x = mesh.vertices()[v];
      nearest = std::min(nearest, std::hypot(x.x, x.z));
    }
  }
  EXPECT_GT(nearest, 0.05);
  EXPECT_LT(nearest, 0.16);  // a sixth of an edge length may be missed
  EXPECT_NEAR(volume, hull.volume, 0.02 * kRidgeSize.ny);
}

TEST(ExtendToRidges, LeadsRowsToJustBeforeTheEdge) {
  const Hull hull = WedgeHull(kDegrees);
  WorkingMesh mesh(WedgeComplex(kDegrees, kBegin, kRidgeSize));
  EXPECT_EQ(mesh.OpenFaces().size(), 10u);
  EXPECT_EQ(ExtendToRidges(hull, AcuteRidges(hull), &mesh), 1);
  ExpectHexahedraUpToTheRidge(mesh, hull);
}

TEST(ExtendToRidges, TakesCellsAwayThatStandOut) {
  const Hull hull = WedgeHull(kDegrees);
  CellComplex complex = WedgeComplex(kDegrees, kBegin, kRidgeSize);
  WorkingMesh mesh(complex);
  for (int y = 0; y < kRidgeSize.ny; ++y) mesh.RemoveCell(y * kRidgeSize.nx);  // of the lower layer
  EXPECT_EQ(mesh.OpenFaces().size(), 15u);
  EXPECT_EQ(ExtendToRidges(hull, AcuteRidges(hull), &mesh), 1);
  ExpectHexahedraUpToTheRidge(mesh, hull);
}

TEST(ExtendToRidges, FillsNoTipInPart) {
  // Twice as wide as the cells: rows would leave their sides open in the middle of the tip.
  const Hull hull =
      HullOfMesh(fixtures::MakeWedge(kDegrees, kBegin + kRidgeSize.nx, 2 * kRidgeSize.ny));
  WorkingMesh mesh(WedgeComplex(kDegrees, kBegin, kRidgeSize));
  EXPECT_EQ(ExtendToRidges(hull, AcuteRidges(hull), &mesh), 0);
  EXPECT_EQ(mesh.OpenFaces().size(), 10u);
}

TEST(ExtendToRidges, LeavesBluntEdgesAlone) {
  const Hull hull = WedgeHull(60);
  WorkingMesh mesh(WedgeComplex(60, kBegin, kRidgeSize));
  EXPECT_EQ(ExtendToRidges(hull, AcuteRidges(hull), &mesh), 0);
  EXPECT_EQ(mesh.OpenFaces().size(), 10u);
}

TEST(AcuteRidges, AreEdgesOfTheSolidAndNotOfSlits) {
  EXPECT_EQ(AcuteRidges(WedgeHull(kDegrees)).size(), 1u);
  const TriangleMesh slit =
      fixtures::MakeExtruded({{2, 1}, {1.7, 4}, {0, 4}, {0, 0}, {4, 0}, {4, 4}, {2.3, 4}}, 2);
  const Hull hull = HullOfMesh(slit);
  EXPECT_GT(hull.volume, 0);
  EXPECT_TRUE(AcuteRidges(hull).empty());
}

// The columns of a spike, with the walls between them, up to just before its tip.
class Spikes : public ::testing::TestWithParam<int> {};

TEST_P(Spikes, AreFilledUpToTheirTip) {
  constexpr double kAngle = 12, kWall = 4;
  const GridSize size = {6, GetParam(), GetParam()};
  const Hull hull = HullOfMesh(fixtures::MakeSpike(kAngle, kWall + size.nx));
  WorkingMesh mesh(testing_support::SpikeComplex(kAngle, kWall, size));
  ASSERT_TRUE(mesh.HasOpenFaces());
  EXPECT_EQ(ExtendToTips(hull, AcuteTips(hull), &mesh), 1);
  EXPECT_FALSE(mesh.HasOpenFaces());
  double volume = 0, nearest = 1e9;
  for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
    if (!mesh.alive(cell)) continue;
    EXPECT_TRUE(mesh.is_hexahedron(cell));
    volume += CellVolume(mesh.corners(cell), mesh.vertices());
    for (const int32_t v : mesh.corners(cell)) nearest = std::min(nearest, mesh.vertices()[v].x);
  }
  EXPECT_GT(nearest, 0.05);
  EXPECT_LT(nearest, 0.16);
  EXPECT_NEAR(volume, hull.volume, 0.002);
}

INSTANTIATE_TEST_SUITE_P(ExtendToTips, Spikes, ::testing::Values(1, 2, 3));

TEST(ExtendToTips, LeavesBluntOnesAlone) {
  const GridSize size = {6, 2, 2};
  const Hull hull = HullOfMesh(fixtures::MakeSpike(70, 2.0 + size.nx));
  WorkingMesh mesh(testing_support::SpikeComplex(70, 2, size));
  EXPECT_EQ(ExtendToTips(hull, AcuteTips(hull), &mesh), 0);
  EXPECT_EQ(mesh.OpenFaces().size(), 4u);
}

}  // namespace
}  // namespace amhex
