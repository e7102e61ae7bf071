#include "input/upright_axes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "fixtures/solids.h"
#include "input/build_hull.h"
#include "input/guidance_checks.h"

namespace amhex {
namespace {

struct WorldTurn {
  Vec3d about;
  double radians;
};
const std::vector<WorldTurn> kWorldTurns = {
    {{1, 2, 3}, 0.6}, {{-2, 1, 1}, 2.0}, {{0, 0, 1}, 0.02}, {{1, 1, 0}, 0.785}, {{3, -1, 2}, 3.1}};

// The world's axes with the solid, each to the nearest of `axes`: the largest angle, in radians.
double FarthestFromTurned(const AxisFrame& axes, const WorldTurn& turn) {
  double farthest = 0;
  for (const Vec3d& axis : AxisFrame{}.axis) {
    const Vec3d turned = fixtures::Turned(axis, turn.about, turn.radians);
    double nearest = 2;
    for (const Vec3d& other : axes.axis) {
      nearest = std::min({nearest, Norm(other - turned), Norm(other + turned)});
    }
    farthest = std::max(farthest, nearest);
  }
  return farthest;
}

double Trace(const AxisFrame& axes) { return axes.axis[0].x + axes.axis[1].y + axes.axis[2].z; }

bool IsWorld(const AxisFrame& axes) { return axes.axis == AxisFrame{}.axis; }

absl::StatusOr<Hull> HullOf(const InputHull& input, const MeshingParams& wanted = {}) {
  MeshingParams params = wanted;
  params.sizing.cell_count = 500;
  RunContext run;
  return BuildHull(input, params, run);
}

TEST(UprightAxes, AreThoseOfABoxHoweverItIsTurned) {
  for (const WorldTurn& turn : kWorldTurns) {
    const UprightAxes found = FindUprightAxes(
        fixtures::Turned(fixtures::MakeBox({3, 2, 1}, 0.5), turn.about, turn.radians));
    EXPECT_LT(FarthestFromTurned(found.axes, turn), 1e-9);
    EXPECT_NEAR(found.share_along, 1, 1e-9);
    EXPECT_NEAR(Determinant(found.axes.axis[0], found.axes.axis[1], found.axes.axis[2]), 1, 1e-12);
  }
}

TEST(UprightAxes, AreThoseOfTheFlatPartsWhereOthersAreRound) {
  for (const WorldTurn& turn : kWorldTurns) {
    const UprightAxes found =
        FindUprightAxes(fixtures::Turned(fixtures::MakeBracket(1, 0.1), turn.about, turn.radians));
    EXPECT_LT(FarthestFromTurned(found.axes, turn), 1e-3);
  }
}

TEST(UprightAxes, AreTheWorldsWhereAlreadyMostLiesAlongThose) {
  for (const TriangleMesh& mesh :
       {fixtures::MakeBox({3, 2, 1}, 0.5), fixtures::MakeBracket(1, 0.2)}) {
    const UprightAxes found = FindUprightAxes(mesh);
    EXPECT_TRUE(IsWorld(found.axes));
    EXPECT_EQ(found.share_along, found.share_along_world);
  }
}

TEST(UprightAxes, AreNamedSoThatTheyAreTurnedLeast) {
  for (const WorldTurn& turn : kWorldTurns) {
    const UprightAxes found = FindUprightAxes(
        fixtures::Turned(fixtures::MakeBox({3, 2, 1}, 0.5), turn.about, turn.radians));
    constexpr double kLeastTrace = 1.414;  // no naming leaves more than 62.8 degrees
    EXPECT_GT(Trace(found.axes), kLeastTrace);
  }
}

TEST(UprightAxes, TellLittleOfASurfaceWithoutFlatParts) {
  EXPECT_LT(FindUprightAxes(fixtures::MakeSphere(1, 0.1)).share_along, 0.05);
  EXPECT_LT(FindUprightAxes(fixtures::MakeTorus(3, 1, 0.2)).share_along, 0.05);
}

TEST(UprightAxes, OfTrianglesWithoutAreaAreTheWorlds) {
  EXPECT_TRUE(IsWorld(FindUprightAxes({}).axes));
  EXPECT_TRUE(IsWorld(FindUprightAxes({{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}}).axes));
}

TEST(UprightHull, HasTheFlatPartsOfATurnedSolidAlongItsAxes) {
  const TriangleMesh box = fixtures::MakeBox({4, 3, 2}, 0.25);
  for (const WorldTurn& turn : kWorldTurns) {
    const TriangleMesh turned = fixtures::Turned(box, turn.about, turn.radians);
    const auto hull = HullOf(turned);
    ASSERT_TRUE(hull.ok()) << hull.status();
    std::vector<double> extents;
    for (int a = 0; a < 3; ++a) extents.push_back(hull->box.Extent()[a] * hull->frame.scale);
    std::sort(extents.begin(), extents.end());
    for (size_t a = 0; a < 3; ++a) EXPECT_NEAR(extents[a], static_cast<double>(a) + 2, 1e-9);
    for (size_t v = 0; v < turned.vertices.size(); ++v) {
      EXPECT_NEAR(Norm(hull->frame.ToUser(hull->vertices[v]) - turned.vertices[v]), 0, 1e-12);
      EXPECT_NEAR(Norm(hull->frame.ToNormalized(turned.vertices[v]) - hull->vertices[v]), 0, 1e-12);
    }
  }
}

TEST(UprightHull, MeasuresTheBoxThatTheUserSees) {
  const TriangleMesh turned = fixtures::Turned(fixtures::MakeBox({4, 3, 2}, 0.25), {1, 2, 3}, 0.6);
  Box3d seen;
  for (const Vec3d& p : turned.vertices) seen.Extend(p);
  const auto hull = HullOf(turned);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_NEAR(hull->input_diagonal * hull->frame.scale, seen.Diagonal(), 1e-9);
}

TEST(UprightHull, TurnsGuidanceAlong) {
  const WorldTurn turn = {{1, 2, 3}, 0.6};
  const TriangleMesh turned =
      fixtures::Turned(fixtures::MakeBox({4, 3, 2}, 0.25), turn.about, turn.radians);
  auto hull = HullOf(turned);
  ASSERT_TRUE(hull.ok()) << hull.status();
  const auto along = [&](const Vec3d& v) { return fixtures::Turned(v, turn.about, turn.radians); };
  Guidance guidance;
  guidance.samples.push_back({along({2, 1, 1}), along({0, 5, 0}), along({0, 0, 2})});
  guidance.planes.push_back({along({2, 1, 1}), along({3, 0, 0})});
  ApplyGuidance(guidance, &*hull);
  const auto is_along_axis = [](const Vec3d& v) {
    return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}) > 1 - 1e-9;
  };
  const GuideSample& sample = hull->guidance.samples[0];
  EXPECT_TRUE(is_along_axis(sample.axis));
  EXPECT_TRUE(is_along_axis(sample.second_axis));
  EXPECT_TRUE(is_along_axis(hull->guidance.planes[0].normal));
  EXPECT_NEAR(Norm(hull->frame.ToUser(sample.position) - along({2, 1, 1})), 0, 1e-9);
}

TEST(UprightHull, KeepsTheUsersAxesWhereNothingIsFlatOrTheGridIsToLieAlongThem) {
  const auto ball = HullOf(fixtures::Turned(fixtures::MakeSphere(1, 0.1), {1, 2, 3}, 0.6));
  ASSERT_TRUE(ball.ok()) << ball.status();
  EXPECT_TRUE(IsWorld(ball->frame.axes));
  MeshingParams grid;
  grid.relaxation.initialization = Initialization::kGrid;
  const auto box =
      HullOf(fixtures::Turned(fixtures::MakeBox({4, 3, 2}, 0.25), {1, 2, 3}, 0.6), grid);
  ASSERT_TRUE(box.ok()) << box.status();
  EXPECT_TRUE(IsWorld(box->frame.axes));
}

}  // namespace
}  // namespace amhex
