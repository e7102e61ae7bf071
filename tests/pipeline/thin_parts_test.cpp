// Walls about as thick as a cell, thinner ones, and what is said of those that are lost.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "amhex/mesher.h"
#include "fixtures/damage.h"
#include "fixtures/solids.h"
#include "support/mesh_invariants.h"

namespace amhex {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing_support::BrokenLaws;
using testing_support::MeasureBoundary;
using testing_support::TotalVolume;

absl::StatusOr<MeshingResult> MeshWithEdgesOfOne(const InputHull& solid) {
  MeshingParams params;
  params.sizing.edge_length = 1;
  params.run.backend = Backend::kCpu;
  RunContext run;
  return Mesh(solid, params, run);
}

TriangleMesh Turned(TriangleMesh mesh) {
  return fixtures::Turned(std::move(mesh), {2, -3, 1}, 0.6);
}

// Beside a cube of 7 x 7 x 7, whose sides the grids of all fields follow: they do not follow the
// other body's.
constexpr int64_t kCubeCells = 343;
TriangleMesh BesideCube(const TriangleMesh& mesh) {
  return fixtures::Joined(mesh,
                          fixtures::Translated(fixtures::MakeBox({7, 7, 7}, 0.5), {20, 0, 0}));
}

// A block 4 x 6 x 4 with a fin 4 x 6 x `thickness` at its foot.
TriangleMesh BlockWithFin(double thickness) {
  return fixtures::MakeExtruded(
      {{0, 0}, {4, 0}, {8, 0}, {8, thickness}, {4, thickness}, {4, 4}, {0, 4}},
      {{0, 1, 4}, {1, 2, 3}, {1, 3, 4}, {0, 4, 5}, {0, 5, 6}}, 6);
}

TEST(ThinParts, APlateKeepsOneLayerOfHexahedra) {
  for (const double thickness : {1.0, 0.9, 0.7, 0.55}) {
    SCOPED_TRACE(thickness);
    const TriangleMesh plate = fixtures::MakeBox({8, 7, thickness}, 0.5);
    for (const TriangleMesh& solid : {plate, Turned(plate)}) {
      const auto result = MeshWithEdgesOfOne(solid);
      ASSERT_TRUE(result.ok()) << result.status();
      EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
      EXPECT_EQ(result->statistics.cells_by_type[8], 56);
      EXPECT_EQ(result->statistics.cell_count, 56);
      EXPECT_NEAR(TotalVolume(result->mesh), 56 * thickness, 0.01);
      EXPECT_THAT(result->warnings, IsEmpty());
    }
  }
}

TEST(ThinParts, APlateAcrossTheGridKeepsOneLayerOfHexahedra) {
  for (const double thickness : {1.0, 0.9, 0.7, 0.55}) {
    SCOPED_TRACE(thickness);
    const auto result =
        MeshWithEdgesOfOne(BesideCube(Turned(fixtures::MakeBox({8, 7, thickness}, 0.5))));
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
    EXPECT_EQ(result->statistics.cells_by_type[8], 56 + kCubeCells);
    EXPECT_EQ(result->statistics.cell_count, 56 + kCubeCells);
    EXPECT_NEAR(TotalVolume(result->mesh), 56 * thickness + kCubeCells, 0.01);
    EXPECT_THAT(result->warnings, IsEmpty());
  }
}

TEST(ThinParts, APlateHasAsManyCellsAsWanted) {
  constexpr int64_t kCells = 150;
  for (const double thickness : {0.6, 0.8, 1.2}) {  // layers of cubes would be 1.4 to 0.9 of it
    SCOPED_TRACE(thickness);
    MeshingParams params;
    params.sizing.cell_count = kCells;
    params.run.backend = Backend::kCpu;
    RunContext run;
    const auto result = Mesh(Turned(fixtures::MakeBox({12, 12, thickness}, 0.6)), params, run);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
    EXPECT_NEAR(static_cast<double>(result->statistics.cell_count), kCells, 0.12 * kCells);
  }
}

TEST(ThinParts, TheWallOfATubeKeepsOneLayer) {
  const TriangleMesh tube = fixtures::Joined(fixtures::MakeTorus(6, 2.5, 0.4),
                                             fixtures::Flipped(fixtures::MakeTorus(6, 1.8, 0.4)));
  const auto result = MeshWithEdgesOfOne(tube);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  EXPECT_NEAR(TotalVolume(result->mesh), result->statistics.hull_volume,
              0.05 * result->statistics.hull_volume);
  EXPECT_EQ(MeasureBoundary(result->mesh).component_count, 2);
}

TEST(ThinParts, AFinOnABlockKeepsOneLayer) {
  const auto result = MeshWithEdgesOfOne(BlockWithFin(0.7));
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  EXPECT_NEAR(TotalVolume(result->mesh), 96 + 24 * 0.7, 0.1);
  EXPECT_THAT(result->warnings, IsEmpty());
}

TEST(ThinParts, AFinThatIsLostIsToldWithItsPlace) {
  const auto result = MeshWithEdgesOfOne(BlockWithFin(0.1));
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  EXPECT_TRUE(result->statistics.distance_exceeds_cell);
  ASSERT_EQ(result->warnings.size(), 1u);
  EXPECT_THAT(result->warnings[0], HasSubstr("farther than an edge length from the mesh"));
  // The fin's end is four edge lengths away from the block.
  EXPECT_THAT(result->warnings[0], ContainsRegex("likely: 1; up to (4|3\\.99)"));
  EXPECT_THAT(result->warnings[0], HasSubstr("at (8, "));
}

TEST(ThinParts, EveryLostPartIsCountedOnce) {
  const TriangleMesh one = BlockWithFin(0.1);
  const auto result =
      MeshWithEdgesOfOne(fixtures::Joined(one, fixtures::Translated(one, {0, 9, 0})));
  ASSERT_TRUE(result.ok()) << result.status();
  ASSERT_EQ(result->warnings.size(), 1u);
  EXPECT_THAT(result->warnings[0], ContainsRegex("likely: 2; up to (4|3\\.99)"));
}

TEST(ThinParts, ASheetWithoutThicknessIsToldWithItsPlace) {
  TriangleMesh mesh = fixtures::MakeBox({4, 4, 4}, 1);
  const auto tip = static_cast<int32_t>(mesh.vertices.size());
  mesh.vertices.push_back({-5, 1, 0});
  mesh.triangles.push_back({mesh.triangles[0][0], mesh.triangles[0][1], tip});
  const auto result = MeshWithEdgesOfOne(mesh);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->statistics.cell_count, 64);
  EXPECT_TRUE(result->statistics.distance_exceeds_cell);
  ASSERT_EQ(result->warnings.size(), 2u);
  EXPECT_THAT(result->warnings[0], HasSubstr("loose sheets on the surface, left out: 1"));
  EXPECT_THAT(result->warnings[1], HasSubstr("likely: 1; up to 5 at (-5, 1, 0)"));
}

TEST(ThinParts, ARodOfACloudThatIsLostIsToldWithItsPlace) {
  PointCloud cloud = fixtures::SampleSurface(fixtures::MakeBox({6, 6, 6}, 1), 4000, 1);
  const TriangleMesh rod = fixtures::MakeBox({9, 0.12, 0.12}, 0.06);
  const PointCloud points = fixtures::SampleSurface(rod, 3000, 2);
  for (size_t i = 0; i < points.points.size(); ++i) {
    cloud.points.push_back(points.points[i] + Vec3d{6, 3, 3});
    cloud.normals.push_back(points.normals[i]);
  }
  const auto result = MeshWithEdgesOfOne(cloud);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  EXPECT_TRUE(result->statistics.distance_exceeds_cell);
  ASSERT_FALSE(result->warnings.empty());
  EXPECT_THAT(result->warnings.back(), HasSubstr("farther than an edge length from the mesh"));
  EXPECT_THAT(result->warnings.back(), HasSubstr("at (15"));
}

TEST(ThinParts, ASurfaceWithinTheSolidIsNotToldAsThin) {
  // Both look outward, so that the inner one bounds no cavity.
  PointCloud cloud = fixtures::SampleSurface(fixtures::MakeBox({7, 7, 7}, 1), 4000, 1);
  const PointCloud inner = fixtures::SampleSurface(fixtures::MakeBox({1, 1, 1}, 1), 400, 2);
  for (size_t i = 0; i < inner.points.size(); ++i) {
    cloud.points.push_back(inner.points[i] + Vec3d{3, 3, 3});
    cloud.normals.push_back(inner.normals[i]);
  }
  const auto result = MeshWithEdgesOfOne(cloud);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_TRUE(result->statistics.distance_exceeds_cell);
  ASSERT_FALSE(result->warnings.empty());
  EXPECT_THAT(result->warnings.back(), HasSubstr("surfaces that bound none: 1; up to 3"));
  EXPECT_THAT(result->warnings.back(), Not(HasSubstr("too thin")));
}

// Points on both sides of a plate, half as far from each other as the sides are.
PointCloud CloudOfPlate(double thickness) {
  const auto count = static_cast<size_t>(4 * 2 * 8 * 7 / (thickness * thickness));
  return fixtures::SampleSurface(fixtures::MakeBox({8, 7, thickness}, thickness), count, 1);
}

TEST(ThinParts, ACloudOfAPlateKeepsOneLayerOfHexahedra) {
  const auto result = MeshWithEdgesOfOne(CloudOfPlate(0.7));
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  EXPECT_GT(result->statistics.hexahedra_ratio, 0.9);
  EXPECT_NEAR(TotalVolume(result->mesh), 56 * 0.7, 0.05 * 56 * 0.7);
  EXPECT_FALSE(result->statistics.distance_exceeds_cell);
}

TEST(ThinParts, ACloudTooThinForAnyCellIsToldHowThinItIsAndWhere) {
  const auto result = MeshWithEdgesOfOne(CloudOfPlate(0.43));
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument) << result.status();
  const std::string message(result.status().message());
  EXPECT_THAT(message, HasSubstr("(0.43 edge lengths) thick"));
  EXPECT_THAT(message, HasSubstr("), where"));  // the plate's middle, in z
  EXPECT_THAT(message, HasSubstr("an edge length of at most 0.7"));
}

TEST(ThinParts, APlateTooThinForAnyCellIsTheInputsFault) {
  const auto result = MeshWithEdgesOfOne(fixtures::MakeBox({8, 7, 0.15}, 0.5));
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument) << result.status();
  EXPECT_THAT(std::string(result.status().message()), HasSubstr("thin"));
}

}  // namespace
}  // namespace amhex
