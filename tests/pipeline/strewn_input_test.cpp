// Vertices and points far from where they belong: the size asked for bounds what a run costs,
// however far they are and however many.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "amhex/mesher.h"
#include "fixtures/damage.h"
#include "fixtures/solids.h"
#include "support/mesh_invariants.h"

namespace amhex {
namespace {

using ::testing::AnyOf;
using ::testing::IsEmpty;
using testing_support::BrokenLaws;

constexpr int64_t kStrewnCells = 40;
// Each case takes seconds of an idle machine; what is not bounded takes hours.
constexpr std::chrono::minutes kDeadline{5};

struct StrewnCase {
  std::string name;
  InputHull (*make)();
};

TriangleMesh Torus() { return fixtures::MakeTorus(0.9, 0.4, 0.2); }

// `count` vertices lie up to `boxes` sizes of the solid away.
InputHull TorusWithStrays(int count, double boxes) {
  TriangleMesh mesh = Torus();
  fixtures::Chance chance(3);
  for (int i = 0; i < count; ++i) {
    mesh.vertices[chance.Below(mesh.vertices.size())] = chance.Vector() * (2.6 * boxes);
  }
  return mesh;
}

InputHull Soup(int count, double reach) {
  TriangleMesh mesh;
  fixtures::Chance chance(5);
  for (int i = 0; i < count; ++i) {
    const Vec3d place = chance.Vector();
    const auto first = static_cast<int32_t>(mesh.vertices.size());
    for (int k = 0; k < 3; ++k) mesh.vertices.push_back(place + chance.Vector() * reach);
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

InputHull CloudWithStrays(size_t count, double boxes) {
  PointCloud cloud = fixtures::SampleSurface(Torus(), 600, 3);
  fixtures::Chance chance(3);
  for (size_t i = 0; i < count; ++i) cloud.points[i] = chance.Vector() * (2.6 * boxes);
  return cloud;
}

std::vector<StrewnCase> StrewnCases() {
  return {{"AVertexAThousandBoxesAway", [] { return TorusWithStrays(1, 1e3); }},
          {"AVertexAHundredThousandBoxesAway", [] { return TorusWithStrays(1, 1e5); }},
          {"AVertexTenMillionBoxesAway", [] { return TorusWithStrays(1, 1e7); }},
          {"ThirtyVerticesAThousandBoxesAway", [] { return TorusWithStrays(30, 1e3); }},
          {"FiveVerticesInTheBox", [] { return TorusWithStrays(5, 0.4); }},
          {"AllVerticesInTheBox", [] { return TorusWithStrays(20'000, 0.4); }},
          {"AHundredTrianglesAcrossTheBox", [] { return Soup(100, 1); }},
          {"FiftyThousandTrianglesAcrossTheBox", [] { return Soup(50'000, 1); }},
          {"ManySmallTriangles", [] { return Soup(1'000, 0.1); }},
          {"APointAThousandBoxesAway", [] { return CloudWithStrays(1, 1e3); }},
          {"APointTenMillionBoxesAway", [] { return CloudWithStrays(1, 1e7); }},
          {"ThirtyPointsTenBoxesAway", [] { return CloudWithStrays(30, 10); }},
          {"ThirtyPointsAThousandBoxesAway", [] { return CloudWithStrays(30, 1e3); }},
          {"ThirtyPointsInTheBox", [] { return CloudWithStrays(30, 0.4); }}};
}

class StrewnInput : public testing::TestWithParam<size_t> {};

TEST_P(StrewnInput, EndsInAValidMeshOrAClearErrorLongBeforeTheDeadline) {
  MeshingParams params;
  params.sizing.trial_count = 1;
  params.sizing.cell_count = kStrewnCells;
  params.run.backend = Backend::kCpu;
  RunContext run;
  run.SetDeadline(RunContext::Clock::now() + kDeadline);
  absl::StatusOr<MeshingResult> result = Mesh(StrewnCases()[GetParam()].make(), params, run);
  if (result.ok()) {
    EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
    return;
  }
  // INTERNAL: that no valid mesh was found.
  EXPECT_THAT(result.status().code(),
              AnyOf(absl::StatusCode::kInvalidArgument, absl::StatusCode::kResourceExhausted,
                    absl::StatusCode::kInternal))
      << result.status();
  EXPECT_GT(result.status().message().size(), 20);
}

INSTANTIATE_TEST_SUITE_P(Cases, StrewnInput, testing::Range(size_t{0}, StrewnCases().size()),
                         [](const testing::TestParamInfo<size_t>& instance) {
                           return StrewnCases()[instance.param].name;
                         });

TEST(StrewnInput, TrianglesThatAllCrossEachOtherAreRefusedWithTheEstimate) {
  MeshingParams params;
  params.sizing.cell_count = kStrewnCells;
  params.run.backend = Backend::kCpu;
  RunContext run;
  const auto result = Mesh(Soup(50'000, 1), params, run);
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument) << result.status();
  EXPECT_THAT(std::string(result.status().message()), testing::HasSubstr("the limit is"));
}

}  // namespace
}  // namespace amhex
