// Where a vertex belongs does not depend on what is known of where it belonged before.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "base/array_view_of.h"
#include "fixtures/solids.h"
#include "optimize/hull_features.h"
#include "optimize/placement_view.h"
#include "support/hull_of_mesh.h"

namespace amhex {
namespace {

constexpr double kFarAway = std::numeric_limits<double>::infinity();

// Vertices of the first patch that are moved again and again, near it and far from it.
class KnownFeet : public testing::TestWithParam<TriangleMesh> {
 protected:
  KnownFeet() {
    vertices_.resize(200), feet_.assign(vertices_.size(), {kFarAway, 0, 0});
    constraints_.assign(vertices_.size(), {Constraint::kPatch, 0, -1, -1});
    view_.vertices = WritableViewOf(vertices_);
    view_.constraints = ArrayViewOf(constraints_);
    view_.features = features_.view();
  }

  void MoveAll() {
    std::uniform_real_distribution<double> number(-1, 1);
    std::uniform_int_distribution<size_t> any(0, hull_.vertices.size() - 1);
    for (Vec3d& vertex : vertices_) {
      const double reach = std::pow(10.0, 3 * number(random_) - 3);  // 1e-6 to 1
      vertex = hull_.vertices[any(random_)] +
               Vec3d{number(random_), number(random_), number(random_)} * reach;
    }
  }

  void ExpectTheSameAsIfNothingWereKnown(int64_t v) {
    const ConstrainedPoint expected = Constrain(constraints_[v], vertices_[v], features_.view());
    const ConstrainedPoint found = FindFoot(view_, v);
    EXPECT_EQ(found.point, expected.point) << v;
    EXPECT_EQ(found.normal, expected.normal) << v;
    EXPECT_EQ(FootOf(view_, v).point, expected.point) << v;
  }

  std::mt19937_64 random_{3};
  const Hull hull_ = testing_support::HullOfMesh(GetParam());
  const HullFeatures features_{hull_};
  std::vector<Vec3d> vertices_, feet_;
  std::vector<VertexConstraint> constraints_;
  PlacementView view_;
};

TEST_P(KnownFeet, AreFoundAgainToTheBit) {
  view_.known_feet = WritableViewOf(feet_);
  for (int move = 0; move < 20; ++move) {
    MoveAll();
    for (int64_t v = 0; v < view_.vertices.size; ++v) ExpectTheSameAsIfNothingWereKnown(v);
  }
  for (const Vec3d& foot : feet_) EXPECT_LT(std::abs(foot.x), 10) << "it has been kept";
}

TEST_P(KnownFeet, NeedNotBeKept) {
  MoveAll();
  for (int64_t v = 0; v < view_.vertices.size; ++v) ExpectTheSameAsIfNothingWereKnown(v);
}

TEST_P(KnownFeet, AreNotKeptOfVerticesThatBelongToNoPatch) {
  view_.known_feet = WritableViewOf(feet_);
  MoveAll();
  constraints_[0].kind = Constraint::kFree;
  ExpectTheSameAsIfNothingWereKnown(0);
  EXPECT_EQ(feet_[0].x, kFarAway);
}

INSTANTIATE_TEST_SUITE_P(OfABoxAndATorus, KnownFeet,
                         testing::Values(fixtures::MakeBox({3, 2, 1}, 6),
                                         fixtures::MakeTorus(2, 0.6, 0.1)));

}  // namespace
}  // namespace amhex
