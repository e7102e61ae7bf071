// Where a solid tapers off to a point in which hexahedra have no room.
#include "input/acute_tips.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "fixtures/solids.h"
#include "fixtures/wedges.h"
#include "optimize/hull_deviation.h"
#include "support/hull_of_mesh.h"

namespace amhex {
namespace {

using testing_support::HullOfMesh;

TEST(AcuteTips, ASpikeHasOneAtItsEnd) {
  const std::vector<AcuteTip> tips = AcuteTips(HullOfMesh(fixtures::MakeSpike(10, 20)));
  ASSERT_EQ(tips.size(), 1u);
  EXPECT_NEAR(Norm(tips[0].apex), 0, 1e-12);
  EXPECT_NEAR(tips[0].outward.x, -1, 1e-6);
  // An edge length wide where half of it is the tangent of 5 degrees: 5.7 from the apex.
  EXPECT_NEAR(tips[0].narrow, 5, 1);
}

TEST(AcuteTips, ALongOneIsNarrowForThirtyCellsAtMost) {
  const Hull hull = HullOfMesh(fixtures::MakeSpike(1, 60));
  const std::vector<AcuteTip> tips = AcuteTips(hull);
  ASSERT_EQ(tips.size(), 1u);
  EXPECT_EQ(tips[0].narrow, 30);
}

TEST(AcuteTips, CellsEndNearerThanTheBoundaryMayBeOff) {
  for (const double length : {20.0, 400.0}) {
    const Hull hull = HullOfMesh(fixtures::MakeSpike(4, length));
    const std::vector<AcuteTip> tips = AcuteTips(hull);
    ASSERT_EQ(tips.size(), 1u);
    EXPECT_GE(tips[0].blunted, 0.1);
    EXPECT_LE(tips[0].blunted, 0.75 * LimitsFor(hull).limit);
  }
}

TEST(AcuteTips, BluntSolidsHaveNone) {
  EXPECT_TRUE(AcuteTips(HullOfMesh(fixtures::MakeSpike(70, 20))).empty());
  EXPECT_TRUE(AcuteTips(HullOfMesh(fixtures::MakeBox({3, 4, 5}, 1))).empty());
  EXPECT_TRUE(AcuteTips(HullOfMesh(fixtures::MakeSphere(3, 0.5))).empty());
}

TEST(AcuteTips, APeakOfNoiseIsNone) {
  TriangleMesh mesh = fixtures::MakeSphere(5, 0.3);
  mesh.vertices[mesh.vertices.size() / 2] = mesh.vertices[mesh.vertices.size() / 2] * 1.1;
  EXPECT_TRUE(AcuteTips(HullOfMesh(mesh)).empty());
}

TEST(AcuteTips, ThatOfACavityIsNone) {
  const TriangleMesh cavity = fixtures::Flipped(fixtures::MakeSpike(10, 15));
  const TriangleMesh box = fixtures::Translated(fixtures::MakeBox({30, 10, 10}, 5), {-5, -5, -5});
  EXPECT_TRUE(AcuteTips(HullOfMesh(fixtures::Joined(box, cavity))).empty());
}

}  // namespace
}  // namespace amhex
