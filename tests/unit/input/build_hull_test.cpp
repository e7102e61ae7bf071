#include "input/build_hull.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "fixtures/solids.h"
#include "input/hull_queries.h"
#include "support/hull_measures.h"
#include "support/surface_measures.h"

namespace amhex {
namespace {

using testing_support::SurfaceOf;

using ::testing::HasSubstr;

MeshingParams WithCells(int64_t cell_count) {
  MeshingParams params;
  params.sizing.cell_count = cell_count;
  return params;
}

absl::StatusOr<Hull> Build(const InputHull& input, const MeshingParams& params = WithCells(500)) {
  RunContext run;
  return BuildHull(input, params, run);
}

std::string ErrorOf(const InputHull& input, const MeshingParams& params = WithCells(500)) {
  const absl::StatusOr<Hull> hull = Build(input, params);
  EXPECT_EQ(hull.status().code(), absl::StatusCode::kInvalidArgument) << hull.status();
  return std::string(hull.status().message());
}

bool HasWarning(const Hull& hull, const std::string& text) {
  return std::any_of(hull.warnings.begin(), hull.warnings.end(), [&](const std::string& warning) {
    return warning.find(text) != std::string::npos;
  });
}

TEST(BuildHull, TheNormalisedVolumeIsTheWantedCellCount) {
  for (const TriangleMesh& mesh : {fixtures::MakeBox({3, 2, 1}, 0.25), fixtures::MakeSphere(1, 0.2),
                                   fixtures::MakeBracket(1, 0.25)}) {
    const auto hull = Build(mesh, WithCells(700));
    ASSERT_TRUE(hull.ok()) << hull.status();
    EXPECT_NEAR(hull->volume, 700, 1e-6);
    EXPECT_NEAR(testing_support::EnclosedVolume(SurfaceOf(*hull)), 700, 1e-6);
    EXPECT_TRUE(testing_support::IsClosedAndOriented(SurfaceOf(*hull)));
  }
}

TEST(BuildHull, TheFrameLeadsBackToTheUsersPoints) {
  const TriangleMesh mesh = fixtures::Translated(fixtures::MakeBox({3, 2, 1}, 0.5), {1e7, -4e6, 8});
  const auto hull = Build(mesh);
  ASSERT_TRUE(hull.ok()) << hull.status();
  ASSERT_EQ(hull->vertices.size(), mesh.vertices.size());
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    EXPECT_NEAR(Norm(hull->frame.ToUser(hull->vertices[v]) - mesh.vertices[v]), 0, 1e-8);
  }
}

TEST(BuildHull, ScaleDoesNotChangeTheHull) {
  const TriangleMesh mesh = fixtures::MakeBracket(1, 0.5);
  const auto reference = Build(mesh);
  ASSERT_TRUE(reference.ok());
  for (const double scale : {1e-9, 1e9}) {
    TriangleMesh scaled = mesh;
    for (Vec3d& p : scaled.vertices) p *= scale;
    const auto hull = Build(scaled);
    ASSERT_TRUE(hull.ok()) << hull.status();
    EXPECT_EQ(hull->triangles, reference->triangles);
    EXPECT_EQ(hull->sharp_edges.size(), reference->sharp_edges.size());
    for (size_t v = 0; v < hull->vertices.size(); ++v) {
      EXPECT_NEAR(Norm(hull->vertices[v] - reference->vertices[v]), 0, 1e-9);
    }
  }
}

TEST(BuildHull, TheReportedEdgeLengthGivesTheSameHull) {
  for (const int64_t cells : {0, 500}) {
    const auto first = Build(fixtures::MakeSphere(1.3, 0.2), WithCells(cells));
    ASSERT_TRUE(first.ok());
    MeshingParams again;
    again.sizing.edge_length = first->frame.scale;
    const auto second = Build(fixtures::MakeSphere(1.3, 0.2), again);
    ASSERT_TRUE(second.ok());
    EXPECT_EQ(second->frame.scale, first->frame.scale);
    EXPECT_EQ(second->vertices, first->vertices);
  }
}

TEST(BuildHull, TheDefaultSizePutsTwoCellsAcrossThinParts) {
  const auto edge_length_of = [](const TriangleMesh& mesh) {
    const auto hull = Build(mesh, MeshingParams());
    EXPECT_TRUE(hull.ok()) << hull.status();
    return hull.ok() ? hull->frame.scale : 0;
  };
  EXPECT_NEAR(edge_length_of(fixtures::MakeBox({10, 10, 0.3}, 0.3)), 0.15, 1e-6);
  EXPECT_NEAR(edge_length_of(fixtures::MakeBox({10, 10, 0.2}, 0.3)), 0.1, 1e-6);
  // Of a cube, 5,000 cells are finer than two across.
  EXPECT_NEAR(edge_length_of(fixtures::MakeBox({1, 1, 1}, 0.25)), std::cbrt(1 / 5000.0), 1e-6);
}

TEST(BuildHull, GenusIsCounted) {
  const auto torus = Build(fixtures::MakeTorus(2, 0.6, 0.2));
  ASSERT_TRUE(torus.ok());
  EXPECT_EQ(torus->genus, 1);
  const auto sphere = Build(fixtures::MakeSphere(1, 0.3));
  ASSERT_TRUE(sphere.ok());
  EXPECT_EQ(sphere->genus, 0);
  EXPECT_EQ(sphere->component_count, 1);
}

TEST(BuildHull, ABoxHasTwelveSharpChainsEightCornersAndSixPatches) {
  const auto hull = Build(fixtures::MakeBox({3, 2, 1}, 0.25));
  ASSERT_TRUE(hull.ok());
  EXPECT_EQ(hull->sharp_edges.size(), 4u * (12 + 8 + 4));
  EXPECT_EQ(std::count(hull->sharp_degree.begin(), hull->sharp_degree.end(), 3), 8);
  EXPECT_EQ(*std::max_element(hull->patch.begin(), hull->patch.end()), 5);
}

TEST(BuildHull, ASphereHasNoSharpEdge) {
  const auto hull = Build(fixtures::MakeSphere(1, 0.1));
  ASSERT_TRUE(hull.ok());
  EXPECT_TRUE(hull->sharp_edges.empty());
}

TEST(BuildHull, AnAngleOf180KeepsNoSharpEdge) {
  MeshingParams params = WithCells(500);
  params.input.sharp_angle_degrees = 180;
  const auto hull = Build(fixtures::MakeBox({1, 1, 1}, 0.25), params);
  ASSERT_TRUE(hull.ok());
  EXPECT_TRUE(hull->sharp_edges.empty());
}

TEST(BuildHull, ShortSharpChainsAreNoise) {
  // One vertex of a fine sphere pushed in: a dent far below the edge length.
  TriangleMesh mesh = fixtures::MakeSphere(1, 0.05);
  mesh.vertices[100] *= 0.93;
  const auto hull = Build(mesh, WithCells(500));
  ASSERT_TRUE(hull.ok());
  EXPECT_TRUE(hull->sharp_edges.empty());
}

TEST(BuildHull, InvertedSurfacesAreTurnedOutward) {
  const auto hull = Build(fixtures::Flipped(fixtures::MakeBracket(1, 0.5)));
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_GT(testing_support::EnclosedVolume(SurfaceOf(*hull)), 0);
}

TEST(BuildHull, MixedOrientationsAreMadeToAgree) {
  TriangleMesh mesh = fixtures::MakeTorus(2, 0.6, 0.3);
  for (size_t t = 0; t < mesh.triangles.size(); t += 3) {
    std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  }
  const auto hull = Build(mesh);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_TRUE(testing_support::IsClosedAndOriented(SurfaceOf(*hull)));
  EXPECT_TRUE(HasWarning(*hull, "turned"));
}

TEST(BuildHull, HollowPartsStayHollow) {
  const TriangleMesh outer = fixtures::MakeSphere(2, 0.3), inner = fixtures::MakeSphere(1, 0.3);
  const double wall =
      testing_support::EnclosedVolume(outer) - testing_support::EnclosedVolume(inner);
  for (const bool inverted : {false, true}) {
    TriangleMesh mesh = fixtures::Joined(outer, fixtures::Flipped(inner));
    if (inverted) mesh = fixtures::Flipped(mesh);
    const auto hull = Build(mesh);
    ASSERT_TRUE(hull.ok()) << hull.status();
    EXPECT_EQ(hull->component_count, 2);
    EXPECT_NEAR(hull->volume * std::pow(hull->frame.scale, 3), wall, 1e-9);
    EXPECT_FALSE(hull->queries->IsInside(hull->frame.ToNormalized({0, 0, 0})));
  }
}

TEST(BuildHull, ASolidWithinASolidIsPartOfIt) {
  const TriangleMesh outer = fixtures::MakeSphere(2, 0.3), inner = fixtures::MakeSphere(1, 0.3);
  const auto hull = Build(fixtures::Joined(outer, inner));
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->component_count, 1);
  EXPECT_NEAR(hull->volume * std::pow(hull->frame.scale, 3), testing_support::EnclosedVolume(outer),
              1e-9);
}

TEST(BuildHull, TrianglesWithVerticesOfTheirOwnAreJoined) {
  const TriangleMesh mesh = fixtures::MakeBracket(1, 0.5);
  TriangleMesh soup;
  for (const auto& t : mesh.triangles) {
    const auto first = static_cast<int32_t>(soup.vertices.size());
    for (const int32_t v : t) soup.vertices.push_back(mesh.vertices[static_cast<size_t>(v)]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  const auto hull = Build(soup);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->vertices.size(), mesh.vertices.size());
  EXPECT_EQ(hull->genus, 1);
}

TEST(BuildHull, RepeatedAndEmptyTrianglesAndUnusedVerticesChangeNothing) {
  TriangleMesh mesh = fixtures::MakeBox({1, 1, 1}, 0.25);
  const size_t vertex_count = mesh.vertices.size(), triangle_count = mesh.triangles.size();
  mesh.triangles.push_back(mesh.triangles[3]);
  mesh.triangles.push_back({mesh.triangles[5][1], mesh.triangles[5][0], mesh.triangles[5][2]});
  mesh.triangles.push_back({4, 4, 7});
  mesh.vertices.push_back({9, 9, 9});
  const auto hull = Build(mesh);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->vertices.size(), vertex_count);
  EXPECT_EQ(hull->triangles.size(), triangle_count);
  EXPECT_NEAR(hull->volume, 500, 1e-6);
}

TEST(BuildHull, OpeningsAreCappedAndTold) {
  TriangleMesh mesh = fixtures::MakeCylinder(1, 2, 0.2);
  std::erase_if(mesh.triangles, [&](const auto& t) {
    return std::all_of(t.begin(), t.end(), [&](int32_t v) {
      const double z = mesh.vertices[static_cast<size_t>(v)].z;
      return z < 1e-9 || z > 2 - 1e-9;
    });
  });
  const auto hull = Build(mesh);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_TRUE(testing_support::IsClosedAndOriented(SurfaceOf(*hull)));
  EXPECT_TRUE(HasWarning(*hull, "2 openings"));
  EXPECT_NEAR(hull->volume * std::pow(hull->frame.scale, 3), 2 * 3.14159, 0.15);
}

TEST(BuildHull, SolidsThatCutEachOtherBecomeTheirUnion) {
  const TriangleMesh box = fixtures::MakeBox({2, 2, 2}, 0.25);
  const auto hull = Build(fixtures::Joined(box, fixtures::Translated(box, {1, 1, 1})));
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->component_count, 1);
  EXPECT_TRUE(testing_support::IsClosedAndOriented(SurfaceOf(*hull)));
  EXPECT_NEAR(hull->volume * std::pow(hull->frame.scale, 3), 8 + 8 - 1, 0.3);
  EXPECT_TRUE(HasWarning(*hull, "rebuilt"));
}

TEST(BuildHull, SolidsThatShareAnEdgeAreClosedApartOrTogether) {
  // Edges with four triangles.
  const TriangleMesh box = fixtures::MakeBox({1, 1, 1}, 0.25);
  TriangleMesh mesh = fixtures::Joined(box, fixtures::Translated(box, {1, 1, 0}));
  const auto hull = Build(mesh);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_TRUE(testing_support::IsClosedAndOriented(SurfaceOf(*hull)));
  EXPECT_NEAR(hull->volume * std::pow(hull->frame.scale, 3), 2, 0.1);
}

TEST(BuildHull, FinsOnASolidAreLeftOut) {
  TriangleMesh mesh = fixtures::MakeBox({2, 2, 2}, 0.5);
  const size_t triangle_count = mesh.triangles.size();
  for (size_t t = 0; t < 40; t += 8) {
    const auto tip = static_cast<int32_t>(mesh.vertices.size());
    const auto corners = mesh.triangles[t];
    mesh.vertices.push_back(mesh.vertices[static_cast<size_t>(corners[0])] * 1.3);
    mesh.triangles.push_back({corners[0], corners[1], tip});
  }
  const auto hull = Build(mesh);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->triangles.size(), triangle_count);
  EXPECT_TRUE(HasWarning(*hull, "loose sheets"));
}

TEST(BuildHull, ASurfaceInShredsIsRebuilt) {
  const TriangleMesh mesh = fixtures::MakeBracket(1, 0.2);
  TriangleMesh shreds;
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto first = static_cast<int32_t>(shreds.vertices.size());
    const double shift = 0.002 * (static_cast<double>(i % 7) - 3);
    for (const int32_t v : mesh.triangles[i]) {
      shreds.vertices.push_back(mesh.vertices[static_cast<size_t>(v)] + Vec3d{shift, -shift, 0});
    }
    shreds.triangles.push_back({first, first + 1, first + 2});
  }
  const auto hull = Build(shreds);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_TRUE(testing_support::IsClosedAndOriented(SurfaceOf(*hull)));
  EXPECT_EQ(hull->genus, 1);
  EXPECT_NEAR(hull->volume * std::pow(hull->frame.scale, 3), testing_support::EnclosedVolume(mesh),
              0.1);
}

TEST(BuildHull, CoarseRoundsHaveNoSharpFacets) {
  // 8 facets of 45 degrees around; only the rims are sharp.
  const auto hull = Build(fixtures::MakeCylinder(1, 4, 1.0), WithCells(300));
  ASSERT_TRUE(hull.ok()) << hull.status();
  ASSERT_FALSE(hull->sharp_edges.empty());
  for (const SharpEdge& edge : hull->sharp_edges) {
    const Vec3d a = hull->vertices[static_cast<size_t>(edge.vertex_a)];
    const Vec3d b = hull->vertices[static_cast<size_t>(edge.vertex_b)];
    EXPECT_NEAR(a.z, b.z, 1e-9);
  }
}

TEST(BuildHull, BadCoordinatesAreNamedWithIndexAndCount) {
  TriangleMesh mesh = fixtures::MakeBox({1, 1, 1}, 0.5);
  mesh.vertices[5].y = std::numeric_limits<double>::quiet_NaN();
  mesh.vertices[7].z = std::numeric_limits<double>::infinity();
  const std::string message = ErrorOf(mesh);
  EXPECT_THAT(message, HasSubstr("vertex 5"));
  EXPECT_THAT(message, HasSubstr("first of 2"));
}

TEST(BuildHull, BadIndicesAreNamedWithIndexAndCount) {
  TriangleMesh mesh = fixtures::MakeBox({1, 1, 1}, 0.5);
  mesh.triangles[4][1] = -1;
  mesh.triangles[9][2] = 100000;
  mesh.triangles[11][0] = 100000;
  const std::string message = ErrorOf(mesh);
  EXPECT_THAT(message, HasSubstr("triangle 4"));
  EXPECT_THAT(message, HasSubstr("first of 3"));
}

TEST(BuildHull, InputsWithoutVolumeAreRefused) {
  EXPECT_THAT(ErrorOf(TriangleMesh{}), HasSubstr("no triangles"));
  EXPECT_THAT(ErrorOf(PointCloud{}), HasSubstr("no points"));
  TriangleMesh flat;
  flat.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 0}};
  flat.triangles = {{0, 1, 2}, {0, 2, 3}};
  EXPECT_THAT(ErrorOf(flat), HasSubstr("in one plane"));
  flat.vertices.resize(3);
  flat.triangles.resize(1);
  EXPECT_THAT(ErrorOf(flat), HasSubstr("at least 4"));
  PointCloud line;
  for (int i = 0; i < 9; ++i) line.points.push_back({i * 1.0, i * 2.0, 0});
  EXPECT_THAT(ErrorOf(line), HasSubstr("on one line"));
  PointCloud equal;
  equal.points.assign(9, {1, 2, 3});
  EXPECT_THAT(ErrorOf(equal), HasSubstr("at one point"));
}

TEST(BuildHull, CloudsNeedAsManyNormalsAsPoints) {
  PointCloud cloud = fixtures::SampleCentres(fixtures::MakeSphere(1, 0.3));
  cloud.normals.pop_back();
  EXPECT_THAT(ErrorOf(cloud), HasSubstr("normals"));
}

TEST(BuildHull, TooSmallEdgeLengthsAreOutOfRange) {
  MeshingParams params;
  params.sizing.edge_length = 1e-4;
  const auto hull = Build(fixtures::MakeBox({1, 1, 1}, 0.5), params);
  EXPECT_EQ(hull.status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(hull.status().message()), HasSubstr("20000000"));
}

TEST(BuildHull, TooLargeEdgeLengthsAreRefused) {
  MeshingParams params;
  params.sizing.edge_length = 50;
  EXPECT_THAT(ErrorOf(fixtures::MakeBox({1, 1, 1}, 0.5), params), HasSubstr("edge_length"));
}

TEST(BuildHull, MoreMemoryThanPermittedIsRefusedBeforeItIsUsed) {
  MeshingParams params = WithCells(1'000'000);
  params.run.memory_limit_bytes = 100'000'000;
  const auto hull = Build(fixtures::MakeSphere(1, 0.3), params);
  EXPECT_EQ(hull.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(hull.status().message()), HasSubstr("100000000"));
}

TEST(BuildHull, AStoppedRunIsCancelled) {
  RunContext run;
  run.RequestStop();
  const auto hull = BuildHull(fixtures::MakeSphere(1, 0.3), WithCells(100), run);
  EXPECT_EQ(hull.status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace amhex
