#include "fields/orientation_field.h"

#include <gtest/gtest.h>

#include "fixtures/solids.h"
#include "unit/fields/field_fixtures.h"

namespace amhex::fields {
namespace {

TEST(OrientationField, FollowsTheAxesOfABoxEverywhere) {
  const AxisFrame turn = ToFrame(SkewRotation());
  const SolvedFields fields(Turned(turn, fixtures::MakeBox({4, 5, 6}, 1)));
  ASSERT_TRUE(fields.ok);
  for (const Quaternion& frame : fields.frames) {
    for (const Vec3d& axis : turn.axis) {
      EXPECT_GT(FindNearestAxis(ToFrame(frame), axis).cosine, 0.9999);
    }
  }
}

TEST(OrientationField, PutsAnAxisOnTheNormalNextToASmoothHull) {
  const SolvedFields fields(fixtures::MakeTorus(5, 2, 0.4));
  ASSERT_TRUE(fields.ok);
  for (int64_t i = 0; i < fields.grid.count(); ++i) {
    const auto constraints = fields.grid.fine().ConstraintsOf(i);
    if (constraints.size() != 1) continue;
    const Vec3d& normal = constraints[0].normal;
    EXPECT_GT(FindNearestAxis(ToFrame(fields.frames[i]), normal).cosine, 0.98);
  }
}

// By how much the axes nearest to the hull's normals miss them, over the nodes next to a sphere, on
// which no frames follow all of them.
double MissedNormals(const OrientationSettings& settings) {
  const Hull hull = HullOf(fixtures::MakeSphere(3, 0.4));
  RunContext run;
  const ProgressSlice slice(run, 0, 1);
  const auto grid = BuildBackgroundGrid(hull, 1.0 / kNodesPerEdge, slice);
  EXPECT_TRUE(grid.ok());
  const auto field = SolveOrientationField(*grid, {}, settings, slice);
  EXPECT_TRUE(field.ok());
  double sum = 0;
  for (int64_t i = 0; i < grid->count(); ++i) {
    for (const HullConstraint& hull_there : grid->fine().ConstraintsOf(i)) {
      sum += 1 - FindNearestAxis(ToFrame(field->frames[i]), hull_there.normal).cosine;
    }
  }
  return sum;
}

TEST(OrientationField, FollowsTheHullLessWhereNormalsFadeOrWeighLess) {
  OrientationSettings fading, light;
  fading.normal_fading = 0.7;
  light.hull_weight = 3;
  const double all = MissedNormals({});
  EXPECT_GT(MissedNormals(fading), 1.05 * all);
  EXPECT_GT(MissedNormals(light), 1.05 * all);
}

TEST(OrientationField, MatchedNeighboursTurnLittleAwayFromSingularities) {
  const SolvedFields fields(fixtures::MakeTwistedBox({4, 4, 8}, 0.8, 0.5));
  ASSERT_TRUE(fields.ok);
  for (int64_t i = 0; i < fields.grid.count(); ++i) {
    for (const int32_t j : fields.grid.fine().neighbours[i]) {
      if (j < 0) continue;
      EXPECT_GT(std::abs(Dot(fields.frames[i], Matched(fields.frames[i], fields.frames[j]))), 0.98);
    }
  }
}

TEST(OrientationField, FollowsFacesThatAreAsFarFromOneAxisAsFromTheOthers) {
  const SolvedFields fields(fixtures::MakeTetrahedron(5));
  ASSERT_TRUE(fields.ok);
  int64_t following = 0, all = 0;
  for (int64_t i = 0; i < fields.grid.count(); ++i) {
    const auto constraints = fields.grid.fine().ConstraintsOf(i);
    if (constraints.size() != 1) continue;
    const Vec3d& normal = constraints[0].normal;
    following += FindNearestAxis(ToFrame(fields.frames[i]), normal).cosine > 0.98 ? 1 : 0;
    ++all;
  }
  // Between the faces, where curves of singular frames reach the hull, some follow none.
  EXPECT_GT(following, all * 9 / 10);
}

// Mean squared sine of half the angle between matched neighbours.
double Roughness(const SolvedFields& fields) {
  double sum = 0;
  int64_t edges = 0;
  for (int64_t i = 0; i < fields.grid.count(); ++i) {
    for (const int32_t j : fields.grid.fine().neighbours[i]) {
      if (j < 0) continue;
      const double c = Dot(fields.frames[i], Matched(fields.frames[i], fields.frames[j]));
      sum += 1 - c * c;
      ++edges;
    }
  }
  return sum / static_cast<double>(edges);
}

TEST(OrientationField, IsAsSmoothInATurnedSolid) {
  const TriangleMesh torus = fixtures::MakeTorus(6, 3, 0.5);
  const SolvedFields straight(torus);
  const SolvedFields turned(Turned(ToFrame(SkewRotation()), torus));
  ASSERT_TRUE(straight.ok);
  ASSERT_TRUE(turned.ok);
  EXPECT_NEAR(Roughness(turned) / Roughness(straight), 1, 0.15);
}

TEST(OrientationField, RotationsFromBothEndsOfAnEdgeAreInverse) {
  const SolvedFields fields(fixtures::MakeSphere(3, 0.4));
  ASSERT_TRUE(fields.ok);
  const GridLevel& level = fields.grid.fine();
  for (int64_t i = 0; i < level.count(); ++i) {
    for (int k = 0; k < kNeighbourCount; ++k) {
      const int32_t j = level.neighbours[i][k];
      if (j < 0 || !IsAxisNeighbour(k)) continue;
      EXPECT_EQ(Compose(RotationFrom(level, fields.codes, i, k),
                        RotationFrom(level, fields.codes, j, Opposite(k))),
                AxisRotation{});
    }
  }
}

}  // namespace
}  // namespace amhex::fields
