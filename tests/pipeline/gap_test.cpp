// Bodies, and sides of a slot, that are nearer to each other than a cell is wide stay apart.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "amhex/mesher.h"
#include "fixtures/solids.h"
#include "support/mesh_invariants.h"
#include "support/surface_measures.h"

namespace amhex {
namespace {

using ::testing::IsEmpty;
using testing_support::BrokenLaws;

absl::StatusOr<MeshingResult> MeshWithEdgesOfOne(const TriangleMesh& solid) {
  MeshingParams params;
  params.sizing.edge_length = 1;
  params.sizing.trial_count = 2;
  params.run.backend = Backend::kCpu;
  RunContext run;
  return Mesh(solid, params, run);
}

// Two boxes, the second one set off a little along both directions of the gap.
TriangleMesh BoxesApart(double gap) {
  const TriangleMesh box = fixtures::MakeBox({5, 5, 5}, 1);
  return fixtures::Joined(box, fixtures::Translated(box, {5 + gap, 0.3, 0.4}));
}

TEST(Gaps, BodiesBesideEachOtherAreNotGlued) {
  for (const double gap : {0.1, 0.3, 0.5, 0.7}) {
    SCOPED_TRACE(gap);
    const auto result = MeshWithEdgesOfOne(BoxesApart(gap));
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
    EXPECT_EQ(result->statistics.boundary_component_count, 2);
    EXPECT_NEAR(result->statistics.volume, 250, 1e-6);
    EXPECT_LT(result->statistics.input_to_mesh_max, 1e-6);
    EXPECT_THAT(result->warnings, IsEmpty());
  }
}

TEST(Gaps, RoundBodiesBesideEachOtherAreNotGlued) {
  const TriangleMesh ball = fixtures::MakeSphere(3, 0.5);
  for (const double gap : {0.3, 0.6}) {
    SCOPED_TRACE(gap);
    const auto result =
        MeshWithEdgesOfOne(fixtures::Joined(ball, fixtures::Translated(ball, {6 + gap, 0, 0})));
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
    EXPECT_EQ(result->statistics.boundary_component_count, 2);
    EXPECT_EQ(result->statistics.genus, 0);
  }
}

// A block 5 x 4 x 6 with a slot 4 deep through it, between its two halves.
TriangleMesh SlottedBlock(double width) {
  const double right = 5 + width, far_side = 2.5 + width;
  return fixtures::MakeExtruded(
      {{0, 0}, {right, 0}, {right, 6}, {far_side, 6}, {far_side, 2}, {2.5, 2}, {2.5, 6}, {0, 6}},
      {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {0, 4, 5}, {0, 5, 7}, {5, 6, 7}}, 4);
}

TEST(Gaps, ANarrowSlotStaysOpen) {
  for (const double width : {0.4, 0.6}) {
    SCOPED_TRACE(width);
    const auto result = MeshWithEdgesOfOne(SlottedBlock(width));
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
    EXPECT_EQ(result->statistics.genus, 0);
    EXPECT_FALSE(result->statistics.distance_exceeds_cell);
    EXPECT_NEAR(result->statistics.volume, 120 + 8 * width, 2);
  }
}

}  // namespace
}  // namespace amhex
