// Laws of moving the vertices of a place together: how firmly guards hold is the place's own.
#include "optimize/joint_place.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "fixtures/solids.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"
#include "support/hull_of_mesh.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;
using testing_support::GridVertex;
using testing_support::HullOfMesh;

constexpr GridSize kJointSize{4, 4, 4};

TEST(JointPlace, GuardsEachPlaceLooselyAtFirstAndNotEverMoreFirmly) {
  const Hull hull = GridHull(kJointSize, 0.5);
  const HullFeatures features(hull);
  CellComplex complex = GridComplex(kJointSize);
  Placement placement = PreparePlacement(complex, features);
  JointPlace place(placement);
  for (const int32_t cell : {0, 5}) {
    place.Enter({cell});
    int times = 0;
    while (times < 100 && place.GuardMoreFirmly()) ++times;
    EXPECT_GT(times, 0) << cell;
    EXPECT_LT(times, 10) << cell;
    EXPECT_FALSE(place.GuardMoreFirmly()) << cell;
    place.Leave();
  }
}

// A box that does not lie along the axes, so that steps on its edges are rounded. A vertex near the
// end of one is drawn beyond it.
TEST(JointPlace, LeavesAVertexThatIsDrawnBeyondTheEndOfItsCreaseExactlyWhereItIs) {
  const auto turned = [](const Vec3d& p) {
    const Vec3d q{0.8 * p.x - 0.6 * p.y, 0.6 * p.x + 0.8 * p.y, p.z};
    return Vec3d{q.x, (5 * q.y - 12 * q.z) / 13, (12 * q.y + 5 * q.z) / 13};
  };
  TriangleMesh box = fixtures::MakeBox({4, 4, 4}, 0.5);
  for (Vec3d& p : box.vertices) p = turned(p);
  const Hull hull = HullOfMesh(box);
  const HullFeatures features(hull);
  CellComplex complex = GridComplex(kJointSize);
  for (Vec3d& p : complex.vertices) p = turned(p);
  // The last vertex before the corner, moved nearly onto it.
  const int32_t last = GridVertex(kJointSize, 3, 0, 0), corner = GridVertex(kJointSize, 4, 0, 0);
  Placement placement = PreparePlacement(complex, features);
  ASSERT_EQ(placement.constraints.vertex[last].kind, Constraint::kCrease);
  const Vec3d along = complex.vertices[corner] - complex.vertices[last];
  complex.vertices[last] = complex.vertices[corner] - along * 1e-6;
  JointPlace place(placement);
  place.Enter({placement.neighbourhoods.cells[last].begin()[0]});
  const std::vector<Vec3d> before = place.Positions();
  place.FitHere(place.Judge(0.5), 0.5);
  std::vector<Vec3d> moves(before.size());
  const auto& moving = place.moving();
  const auto found = std::find(moving.begin(), moving.end(), last);
  ASSERT_NE(found, moving.end());
  Vec3d& move = moves[static_cast<size_t>(found - moving.begin())];
  move = along * 0.1;
  place.Move(moves);
  EXPECT_EQ(place.Positions(), before);
  // Backwards it may move.
  move = along * -0.1;
  place.Move(moves);
  EXPECT_NEAR(Norm(complex.vertices[last] - complex.vertices[corner]), 0.1, 1e-5);
}

}  // namespace
}  // namespace amhex
