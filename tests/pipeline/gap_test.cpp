// Bodies, and sides of a slot, that are nearer to each other than a cell is wide stay apart.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

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

// A pocket between two walls that meet and a round post, so long along either wall and so high, as
// a cavity of its own; the post, whose axis is so far from either wall, bulges into it.
TriangleMesh PocketBesidePost(double leg, double axis, double height) {
  constexpr int kSteps = 8;
  std::vector<std::array<double, 2>> outline = {{0, 0}};
  std::vector<std::array<int, 3>> inside;
  const double radius = std::hypot(axis - leg, axis);
  // From where the post meets the one wall to where it meets the other.
  const double half = std::numbers::pi / 4 - std::asin((axis - leg) / radius);
  for (int i = 0; i <= kSteps; ++i) {
    const double angle = 1.25 * std::numbers::pi + half * (1 - 2.0 * i / kSteps);
    outline.push_back({axis + radius * std::cos(angle), axis + radius * std::sin(angle)});
    if (i > 0) inside.push_back({0, i, i + 1});
  }
  return fixtures::MakeExtruded(outline, inside, height);
}

TEST(Gaps, APocketBetweenAWallAndAPostStaysOpen) {
  const TriangleMesh block = fixtures::MakeBox({8, 8, 8}, 1);
  const TriangleMesh pocket = fixtures::Translated(PocketBesidePost(0.77, 1.9, 5), {1.3, 1.5, 1.3});
  const auto result = MeshWithEdgesOfOne(fixtures::Joined(block, fixtures::Flipped(pocket)));
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  EXPECT_EQ(result->statistics.boundary_component_count, 2);
  EXPECT_EQ(result->statistics.genus, 0);
  EXPECT_THAT(result->warnings, IsEmpty());
}

TEST(Gaps, APocketWhoseTipsAreNarrowerThanACellStaysOpen) {
  const TriangleMesh block = fixtures::MakeBox({8, 8, 5.6}, 8);
  for (const double leg : {2.7, 3.15}) {
    SCOPED_TRACE(leg);
    const TriangleMesh pocket =
        fixtures::Translated(PocketBesidePost(leg, 2.05 * leg, 2), {1.7, 1.9, 1.7});
    const auto result = MeshWithEdgesOfOne(fixtures::Joined(block, fixtures::Flipped(pocket)));
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
    EXPECT_EQ(result->statistics.boundary_component_count, 2);
    EXPECT_EQ(result->statistics.genus, 0);
    EXPECT_GT(result->statistics.hexahedra_ratio, 0.85);
    EXPECT_LT(result->statistics.input_to_mesh_max, 0.5);
    EXPECT_THAT(result->warnings, IsEmpty());
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
