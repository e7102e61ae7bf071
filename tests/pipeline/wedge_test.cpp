// Sides that meet so sharply that cells have no room between them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <tuple>

#include "amhex/mesher.h"
#include "fixtures/wedges.h"
#include "support/mesh_invariants.h"

namespace amhex {
namespace {

using ::testing::IsEmpty;

// Turned by `degrees` about (1, 2, 3).
TriangleMesh Turned(TriangleMesh mesh, double degrees) {
  return fixtures::Turned(std::move(mesh), {1, 2, 3}, degrees * std::numbers::pi / 180);
}

// The wedge's angle, and how far it is turned.
class Wedges : public ::testing::TestWithParam<std::tuple<int, int>> {};

TEST_P(Wedges, AreFilledUpToTheirEdge) {
  const auto& [degrees, turn] = GetParam();
  MeshingParams params;
  params.sizing.cell_count = 1000;
  params.run.backend = Backend::kCpu;
  RunContext run;
  const absl::StatusOr<MeshingResult> result =
      Mesh(Turned(fixtures::MakeRamp(degrees, 5, 8, 5), turn), params, run);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(testing_support::BrokenLaws(result->mesh), IsEmpty());
  // Floors with room below what is reached. Cells that end where they have room leave out two edge
  // lengths of the tip, some 5 % of the diagonal.
  EXPECT_GE(result->statistics.hexahedra_ratio, 0.9);
  EXPECT_GE(result->statistics.min_scaled_jacobian, 0.3);
  EXPECT_LE(result->statistics.input_to_mesh_max, 0.01);
}

INSTANTIATE_TEST_SUITE_P(Mesher, Wedges,
                         ::testing::Values(std::tuple(12, 0), std::tuple(18, 0), std::tuple(25, 0),
                                           std::tuple(35, 0), std::tuple(12, 37)),
                         [](const auto& test) {
                           return std::to_string(std::get<0>(test.param)) + "_turned_" +
                                  std::to_string(std::get<1>(test.param));
                         });

// The angle between a spike's opposite sides.
class SpikesOfManyCells : public ::testing::TestWithParam<int> {};

TEST_P(SpikesOfManyCells, AreFilledUpToTheirTip) {
  MeshingParams params;
  params.sizing.cell_count = 600;
  params.run.backend = Backend::kCpu;
  RunContext run;
  const absl::StatusOr<MeshingResult> result =
      Mesh(Turned(fixtures::MakeSpike(GetParam(), 20), 37), params, run);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(testing_support::BrokenLaws(result->mesh), IsEmpty());
  EXPECT_GE(result->statistics.min_scaled_jacobian, 0.25);
  // Cells that end where they have room leave out up to a quarter of it.
  EXPECT_LE(result->statistics.input_to_mesh_max, 0.015);
}

INSTANTIATE_TEST_SUITE_P(Mesher, SpikesOfManyCells, ::testing::Values(4, 8, 20));

}  // namespace
}  // namespace amhex
