// Volume meshes through the whole engine: what is kept, what is put together, what is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "amhex/mesher.h"
#include "fixtures/volumes.h"
#include "support/mesh_invariants.h"

namespace amhex {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing_support::BrokenLaws;
using testing_support::TotalVolume;

absl::StatusOr<MeshingResult> MeshVolume(const VolumeMesh& volume,
                                         VolumeUse use = VolumeUse::kReassemble,
                                         double min_quality = 0.1) {
  MeshingParams params;
  params.input.volume_use = use;
  params.assembly.min_quality = min_quality;
  RunContext run;
  return Mesh(InputHull(volume), params, run);
}

std::string ErrorOf(const VolumeMesh& volume) {
  const auto result = MeshVolume(volume);
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument) << result.status();
  return std::string(result.status().message());
}

TEST(VolumeMesh, HexahedraComeBackBitForBit) {
  const VolumeMesh volume = fixtures::MakeHexahedra(3);
  const auto result = MeshVolume(volume);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  EXPECT_EQ(result->mesh.vertices, volume.vertices);
  EXPECT_EQ(result->statistics.cells_by_type[8], 27);
  EXPECT_EQ(result->statistics.cell_count, 27);
  EXPECT_THAT(result->warnings, IsEmpty());
}

TEST(VolumeMesh, CellsListedInsideOutAreTheSameCells) {
  VolumeMesh volume = fixtures::MakeHexahedra(2);
  std::reverse(volume.corners.begin(), volume.corners.begin() + 24);       // the first cell
  std::reverse(volume.corners.begin() + 24, volume.corners.begin() + 28);  // one face
  const auto result = MeshVolume(volume);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  EXPECT_EQ(result->statistics.cells_by_type[8], 8);
}

TEST(VolumeMesh, TetrahedraOfCubesBecomeHexahedra) {
  const VolumeMesh volume = fixtures::MakeTetrahedra(3);
  const auto result = MeshVolume(volume);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  EXPECT_EQ(result->mesh.vertices, volume.vertices);
  EXPECT_EQ(result->statistics.cells_by_type[8], 27);
}

// Cubes come out as hexahedra of a scaled Jacobian of 0.64 or less.
VolumeMesh Sheared(VolumeMesh mesh) {
  for (Vec3d& p : mesh.vertices) p.x += 1.2 * p.z;
  return mesh;
}

TEST(VolumeMesh, MergedCellsExceedTheMinimumQuality) {
  const VolumeMesh volume = Sheared(fixtures::MakeTetrahedra(2));
  for (const double least : {0.1, 0.8}) {
    const auto result = MeshVolume(volume, VolumeUse::kReassemble, least);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
    EXPECT_EQ(result->statistics.cells_by_type[8] > 0, least < 0.2) << least;
    for (size_t c = 0; c < result->mesh.types.size(); ++c) {
      if (result->mesh.types[c] == PrimitiveType::kTetrahedron) continue;  // may be as given
      EXPECT_GT(result->mesh.quality[c], least);
    }
  }
}

TEST(VolumeMesh, HexahedraThatWereGivenAreKeptBelowTheMinimumQualityToo) {
  const VolumeMesh volume = Sheared(fixtures::MakeHexahedra(2));
  const auto result = MeshVolume(volume, VolumeUse::kReassemble, 0.9);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->mesh.vertices, volume.vertices);
  EXPECT_EQ(result->statistics.cells_by_type[8], 8);
  EXPECT_EQ(result->statistics.cell_count, 8);
}

TEST(VolumeMesh, APolyhedronAmongHexahedraLeavesThemAsTheyAre) {
  // Two cubes with the face between them left out: ten quads, not all of them quite flat.
  VolumeMesh volume = fixtures::MakeHexahedra(2);
  constexpr int kQuadCorners = 4, kFaces = 6;
  std::vector<std::vector<int32_t>> faces;
  for (int face = 2 * kFaces - 1; face >= 0; --face) {
    const auto begin = volume.corners.end() - kQuadCorners;
    faces.emplace_back(begin, volume.corners.end());
    volume.corners.erase(begin, volume.corners.end());
    volume.face_corners.pop_back();
  }
  volume.cell_faces.resize(volume.cell_faces.size() - 2);
  const auto is_between = [&](const std::vector<int32_t>& face) {
    return std::count_if(faces.begin(), faces.end(), [&](const std::vector<int32_t>& other) {
             return std::is_permutation(face.begin(), face.end(), other.begin(), other.end());
           }) > 1;
  };
  std::vector<std::vector<int32_t>> outer;
  std::copy_if(faces.begin(), faces.end(), std::back_inserter(outer),
               [&](const auto& face) { return !is_between(face); });
  ASSERT_EQ(outer.size(), 10u);
  fixtures::AddPolyhedron(outer, &volume);
  const auto whole = MeshVolume(fixtures::MakeHexahedra(2));
  for (const VolumeUse use : {VolumeUse::kReassemble, VolumeUse::kSubdivide}) {
    const auto result = MeshVolume(volume, use);
    ASSERT_TRUE(whole.ok() && result.ok()) << result.status();
    EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
    EXPECT_NEAR(TotalVolume(result->mesh), TotalVolume(whole->mesh), 1e-9);
    EXPECT_GE(result->statistics.cells_by_type[8], use == VolumeUse::kSubdivide ? 6 * 8 : 6);
    ASSERT_EQ(result->warnings.size(), 1u);
    EXPECT_THAT(result->warnings[0], HasSubstr("broken up around their centre: 1"));
  }
}

TEST(VolumeMesh, SubdivisionMakesFourHexahedraOfATetrahedron) {
  const VolumeMesh volume = fixtures::MakeTetrahedra(2);
  const auto result = MeshVolume(volume, VolumeUse::kSubdivide);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  EXPECT_EQ(result->statistics.cell_count, 4 * 48);
  EXPECT_EQ(result->statistics.hexahedra_ratio, 1.0);
}

TEST(VolumeMesh, OnlyTheHullIsTakenIfThatIsAskedFor) {
  MeshingParams params;
  params.input.volume_use = VolumeUse::kHull;
  params.sizing.cell_count = 300;
  RunContext run;
  const auto result = Mesh(InputHull(fixtures::MakeTetrahedra(2)), params, run);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  EXPECT_GT(result->statistics.cell_count, 150);
  EXPECT_NEAR(result->statistics.volume, result->statistics.hull_volume, 0.3);
}

// Six-sided prism beside nothing: none of Figure 2.
VolumeMesh HexagonalPrism() {
  VolumeMesh mesh;
  std::vector<int32_t> low, high;
  std::vector<std::vector<int32_t>> faces;
  for (int i = 0; i < 6; ++i) {
    const double angle = i * std::acos(-1.0) / 3;
    mesh.vertices.push_back({std::cos(angle), std::sin(angle), 0});
    mesh.vertices.push_back({std::cos(angle), std::sin(angle), 1});
    low.push_back(2 * i), high.push_back(2 * i + 1);
    const int next = (i + 1) % 6;
    faces.push_back({2 * i, 2 * next, 2 * next + 1, 2 * i + 1});
  }
  faces.push_back(low), faces.push_back(high);
  fixtures::AddPolyhedron(faces, &mesh);
  return mesh;
}

TEST(VolumeMesh, OtherPolyhedraAreBrokenUpAndSaidSo) {
  for (const VolumeUse use : {VolumeUse::kReassemble, VolumeUse::kSubdivide}) {
    const auto result = MeshVolume(HexagonalPrism(), use);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
    EXPECT_NEAR(TotalVolume(result->mesh), 1.5 * std::sqrt(3.0), 1e-9);
    ASSERT_EQ(result->warnings.size(), 1u);
    EXPECT_THAT(result->warnings[0], HasSubstr("broken up around their centre: 1"));
  }
}

TEST(VolumeMesh, AQuadAgainstTwoTrianglesIsClosed) {
  VolumeMesh volume = fixtures::MakeHexahedra(2);
  // The last cube as tetrahedra: its quads lie against pairs of triangles.
  const auto v = fixtures::GridCell(2, 1, 1, 1);
  volume.cell_faces.pop_back();
  volume.face_corners.resize(volume.face_corners.size() - 6);
  volume.corners.resize(volume.corners.size() - 24);
  constexpr std::array<std::array<int, 2>, 6> kMiddles = {
      {{1, 2}, {2, 3}, {3, 7}, {7, 4}, {4, 5}, {5, 1}}};
  for (const auto& [a, b] : kMiddles) {
    fixtures::AddTetrahedron({v[0], v[a], v[b], v[6]}, &volume);
  }
  const auto result = MeshVolume(volume);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  EXPECT_GE(result->statistics.cells_by_type[8], 7);
}

// n^3 hexahedra, n even, with a slit between four of them at the top, so deep as to cross itself.
VolumeMesh SlitThatCrosses(int n) {
  VolumeMesh mesh = fixtures::MakeHexahedra(n);
  const int half = n / 2;
  const int32_t left = fixtures::GridCell(n, half - 1, half - 1, n - 1)[6];
  const auto right = static_cast<int32_t>(mesh.vertices.size());
  mesh.vertices.push_back(mesh.vertices[static_cast<size_t>(left)] - Vec3d{0.2, 0, 0});
  mesh.vertices[static_cast<size_t>(left)] += Vec3d{0.2, 0, 0};
  for (const int y : {half - 1, half}) {
    const auto cell = mesh.corners.begin() + 24 * (((n - 1) * n + y) * n + half);
    std::replace(cell, cell + 24, left, right);
  }
  return mesh;
}

TEST(VolumeMesh, AFewWallsThatCrossAreKeptAsGivenAndToldOf) {
  const VolumeMesh volume = SlitThatCrosses(12);
  for (const VolumeUse use : {VolumeUse::kReassemble, VolumeUse::kSubdivide}) {
    const auto result = MeshVolume(volume, use);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
    const int64_t pieces = use == VolumeUse::kSubdivide ? 8 : 1;
    EXPECT_EQ(result->statistics.cells_by_type[8], pieces * 12 * 12 * 12);
    EXPECT_EQ(result->statistics.cell_count, pieces * 12 * 12 * 12);
    ASSERT_EQ(result->warnings.size(), 1u);
    EXPECT_THAT(result->warnings[0], HasSubstr("covers places twice"));
  }
}

TEST(VolumeMesh, ASolidThatMostlyCrossesItselfIsRefused) {
  EXPECT_THAT(ErrorOf(SlitThatCrosses(2)), HasSubstr("does not bound a solid"));
}

TEST(VolumeMesh, ScaleAndPlaceDoNotMatter) {
  for (const double scale : {1e-9, 1e9}) {
    VolumeMesh volume = fixtures::MakeTetrahedra(2);
    for (Vec3d& p : volume.vertices) p = (p + Vec3d{1e6, -1e6, 0}) * scale;
    const auto result = MeshVolume(volume);
    ASSERT_TRUE(result.ok()) << scale << ": " << result.status();
    EXPECT_EQ(result->mesh.vertices, volume.vertices) << scale;
    EXPECT_EQ(result->statistics.cells_by_type[8], 8) << scale;
  }
}

TEST(VolumeMesh, EveryThreadCountGivesTheSameCells) {
  const VolumeMesh volume = fixtures::MakeTetrahedra(3);
  std::vector<CellCorners> first;
  for (const int threads : {1, 3}) {
    MeshingParams params;
    params.run.thread_count = threads;
    RunContext run;
    const auto result = Mesh(InputHull(volume), params, run);
    ASSERT_TRUE(result.ok()) << result.status();
    if (threads == 1) first = result->mesh.corners;
    EXPECT_EQ(result->mesh.corners, first);
  }
}

TEST(VolumeMesh, BadListsAreRefusedByTheirFirstCell) {
  VolumeMesh volume = fixtures::MakeHexahedra(2);
  volume.corners[24] = 99, volume.corners[50] = -1;
  EXPECT_THAT(ErrorOf(volume), HasSubstr("cell 1 (first of 2) names vertex 99"));

  volume = fixtures::MakeHexahedra(2);
  volume.cell_faces[3] = 3;
  EXPECT_THAT(ErrorOf(volume), HasSubstr("cell 3 has 3 faces"));

  volume = fixtures::MakeHexahedra(2);
  volume.corners.pop_back();
  EXPECT_THAT(ErrorOf(volume), HasSubstr("192 corners, but 191"));

  volume = fixtures::MakeHexahedra(2);
  volume.vertices[5].z = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(ErrorOf(volume), HasSubstr("vertex 5"));

  EXPECT_THAT(ErrorOf(VolumeMesh()), HasSubstr("no cells"));
}

TEST(VolumeMesh, CellsThatDoNotCloseAndCellsGivenTwiceAreRefused) {
  VolumeMesh volume = fixtures::MakeHexahedra(2);
  volume.corners[24 * 2] = volume.corners[24 * 2 + 1];
  EXPECT_THAT(ErrorOf(volume), HasSubstr("cell 2 is not closed"));

  volume = fixtures::MakeHexahedra(2);
  fixtures::AddHexahedron(fixtures::GridCell(2, 1, 0, 0), &volume);
  EXPECT_THAT(ErrorOf(volume), HasSubstr("overlaps another one"));
}

TEST(VolumeMesh, SizeAndGuidanceAreRefusedForCellsThatAreThereAlready) {
  MeshingParams params;
  params.sizing.cell_count = 100;
  RunContext run;
  auto result = Mesh(InputHull(fixtures::MakeHexahedra(2)), params, run);
  EXPECT_THAT(std::string(result.status().message()), HasSubstr("sizing.cell_count"));

  MeshingInput guided{fixtures::MakeHexahedra(2), {}};
  guided.guidance.planes.push_back({{1, 1, 1}, {0, 0, 1}});
  RunContext second;
  result = Mesh(guided, MeshingParams(), second);
  EXPECT_THAT(std::string(result.status().message()), HasSubstr("guidance"));
}

}  // namespace
}  // namespace amhex
