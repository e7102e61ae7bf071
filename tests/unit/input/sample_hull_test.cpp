#include "input/sample_hull.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fixtures/solids.h"
#include "input/build_hull.h"
#include "input/hull_queries.h"
#include "input/point_tree.h"

namespace amhex {
namespace {

Hull BuildWith(const TriangleMesh& mesh, int64_t cell_count) {
  MeshingParams params;
  params.sizing.cell_count = cell_count;
  RunContext run;
  auto hull = BuildHull(mesh, params, run);
  EXPECT_TRUE(hull.ok()) << hull.status();
  return hull.ok() ? *std::move(hull) : Hull{};
}

HullSamples Sample(const Hull& hull) {
  RunContext run;
  auto samples = SampleHull(hull, Backend::kCpu, run);
  EXPECT_TRUE(samples.ok()) << samples.status();
  return samples.ok() ? *std::move(samples) : HullSamples{};
}

TEST(SampleHull, SamplesLieOnTheHullWithItsNormalsAndOrthogonalTangents) {
  const Hull hull = BuildWith(fixtures::MakeBracket(1, 0.2), 800);
  const HullSamples samples = Sample(hull);
  ASSERT_GT(samples.position.size(), 0u);
  for (size_t i = 0; i < samples.position.size(); ++i) {
    EXPECT_LT(hull.queries->Closest(samples.position[i]).distance, 1e-9);
    EXPECT_NEAR(Norm(samples.normal[i]), 1, 1e-9);
    EXPECT_NEAR(Norm(samples.tangent[i]), 1, 1e-9);
    EXPECT_NEAR(Dot(samples.normal[i], samples.tangent[i]), 0, 1e-9);
    EXPECT_GE(samples.curvature_confidence[i], 0);
    EXPECT_LE(samples.curvature_confidence[i], 1);
  }
}

TEST(SampleHull, SamplesCoverTheHullAboutHalfAnEdgeLengthApart) {
  // Two triangles per side: samples come from the area, not from the triangles.
  const Hull hull = BuildWith(fixtures::MakeBox({2, 1, 1}, 5), 1000);
  const HullSamples samples = Sample(hull);
  const PointTree tree(samples.position);
  for (const Vec3d& vertex : hull.vertices) {
    EXPECT_LT(std::sqrt(tree.Nearest(vertex).squared_distance), 1.0);
  }
  std::vector<PointTree::Neighbour> near;
  for (size_t i = 0; i < samples.position.size(); ++i) {
    tree.Nearest(samples.position[i], 2, near);
    EXPECT_LT(std::sqrt(near[1].squared_distance), 0.9);
    const auto j = static_cast<size_t>(near[1].index);
    if (Dot(samples.normal[i], samples.normal[j]) > 0.9) {
      EXPECT_GE(std::sqrt(near[1].squared_distance), 0.45);
    }
  }
}

TEST(SampleHull, PrincipalDirectionsOfACylinderRunAroundIt) {
  const Hull hull = BuildWith(fixtures::MakeCylinder(1, 3, 0.08), 2000);
  const HullSamples samples = Sample(hull);
  int on_wall = 0;
  for (size_t i = 0; i < samples.position.size(); ++i) {
    const Vec3d p = hull.frame.ToUser(samples.position[i]);
    if (std::abs(samples.normal[i].z) > 0.1 || p.z < 0.5 || p.z > 2.5) continue;
    ++on_wall;
    EXPECT_LT(std::abs(samples.tangent[i].z), 0.15);
    EXPECT_GT(samples.curvature_confidence[i], 0.4);
  }
  EXPECT_GT(on_wall, 100);
}

TEST(SampleHull, PlanesAndSpheresHaveNoPrincipalDirection) {
  const Hull sphere = BuildWith(fixtures::MakeSphere(1, 0.05), 2000);
  for (const float confidence : Sample(sphere).curvature_confidence) EXPECT_LT(confidence, 0.2);

  const Hull box = BuildWith(fixtures::MakeBox({1, 1, 1}, 0.1), 8000);
  const HullSamples samples = Sample(box);
  for (size_t i = 0; i < samples.position.size(); ++i) {
    const Vec3d p = samples.position[i];
    int walls_near = 0;
    for (int axis = 0; axis < 3; ++axis) {
      walls_near += std::abs(p[axis]) > box.box.high[axis] - 1.5 ? 1 : 0;
    }
    if (walls_near == 1) {
      EXPECT_LT(samples.curvature_confidence[i], 1e-3);
    }
  }
}

TEST(SampleHull, TangentsNextToSharpEdgesRunAlongThem) {
  const Hull hull = BuildWith(fixtures::MakeBox({1, 1, 1}, 0.1), 1000);
  const HullSamples samples = Sample(hull);
  int checked = 0;
  for (size_t i = 0; i < samples.position.size(); ++i) {
    const Vec3d p = samples.position[i];
    // Near an edge parallel to x, far from its ends.
    const bool near_edge = std::abs(p.x) < 2 && std::abs(p.y) > hull.box.high.y - 0.5 &&
                           std::abs(p.z) > hull.box.high.z - 0.5;
    if (!near_edge) continue;
    ++checked;
    EXPECT_GT(std::abs(samples.tangent[i].x), 0.99);
    EXPECT_EQ(samples.curvature_confidence[i], 1);
  }
  EXPECT_GT(checked, 20);
}

TEST(SampleHull, BothSidesOfAThinPlateAreSampled) {
  const Hull hull = BuildWith(fixtures::MakeBox({1, 1, 0.05}, 0.1), 20);
  const HullSamples samples = Sample(hull);
  int top = 0, bottom = 0;
  for (const Vec3d& normal : samples.normal) top += normal.z > 0.9, bottom += normal.z < -0.9;
  EXPECT_GT(top, 50);
  EXPECT_NEAR(top, bottom, 0.2 * top);
}

TEST(SampleHull, TheSameHullGivesTheSameSamples) {
  const Hull hull = BuildWith(fixtures::MakeTorus(2, 0.6, 0.2), 500);
  const HullSamples first = Sample(hull), second = Sample(hull);
  EXPECT_EQ(first.position, second.position);
  EXPECT_EQ(first.tangent, second.tangent);
  EXPECT_EQ(first.curvature_confidence, second.curvature_confidence);
}

}  // namespace
}  // namespace amhex
