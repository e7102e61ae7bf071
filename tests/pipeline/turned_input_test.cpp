// How a solid lies in its file makes no difference to its mesh.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "amhex/mesher.h"
#include "fixtures/solids.h"
#include "support/mesh_invariants.h"
#include "support/surface_measures.h"

namespace amhex {
namespace {

using ::testing::IsEmpty;
using testing_support::BrokenLaws;

absl::StatusOr<MeshingResult> MeshOf(const TriangleMesh& solid) {
  MeshingParams params;
  params.sizing.cell_count = 1500;
  params.sizing.trial_count = 2;
  params.run.backend = Backend::kCpu;
  RunContext run;
  return Mesh(solid, params, run);
}

TEST(TurnedInput, ABoxIsAsRegularAsAnUprightOne) {
  const TriangleMesh box = fixtures::MakeBox({4, 3, 2}, 0.25);
  const auto upright = MeshOf(box);
  ASSERT_TRUE(upright.ok()) << upright.status();
  for (const double radians : {0.1, 0.6, 2.2}) {
    const auto turned = MeshOf(fixtures::Turned(box, {1, 2, 3}, radians));
    ASSERT_TRUE(turned.ok()) << turned.status();
    EXPECT_THAT(BrokenLaws(turned->mesh), IsEmpty());
    EXPECT_EQ(turned->statistics.hexahedra_ratio, 1);
    EXPECT_GT(turned->statistics.min_scaled_jacobian, 0.999);
    EXPECT_EQ(turned->statistics.cell_count, upright->statistics.cell_count);
    EXPECT_LT(turned->statistics.mesh_to_input_max, 1e-6);
    EXPECT_LT(turned->statistics.input_to_mesh_max, 1e-6);
    EXPECT_NEAR(turned->statistics.volume, 24, 1e-6);
  }
}

TEST(TurnedInput, ABracketLosesNoHexahedra) {
  const TriangleMesh bracket = fixtures::MakeBracket(1, 0.1);
  const auto upright = MeshOf(bracket);
  ASSERT_TRUE(upright.ok()) << upright.status();
  for (const double radians : {0.3, 0.9}) {
    const auto turned = MeshOf(fixtures::Turned(bracket, {1, 2, 3}, radians));
    ASSERT_TRUE(turned.ok()) << turned.status();
    EXPECT_THAT(BrokenLaws(turned->mesh), IsEmpty());
    EXPECT_EQ(turned->statistics.genus, 1);
    EXPECT_NEAR(turned->statistics.hexahedra_ratio, upright->statistics.hexahedra_ratio, 0.02);
    EXPECT_NEAR(turned->statistics.average_scaled_jacobian,
                upright->statistics.average_scaled_jacobian, 0.02);
    EXPECT_NEAR(turned->statistics.volume, upright->statistics.volume, 0.01);
  }
}

}  // namespace
}  // namespace amhex
