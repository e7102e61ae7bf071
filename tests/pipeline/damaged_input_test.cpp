// Every defect of fixtures/damage.h on several solids: a valid mesh or the right
// error.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <tuple>
#include <vector>

#include "amhex/mesher.h"
#include "fixtures/damage.h"
#include "fixtures/solids.h"
#include "support/mesh_invariants.h"

namespace amhex {
namespace {

using ::testing::IsEmpty;
using testing_support::BrokenLaws;

constexpr uint32_t kMeshSeeds = 2;
constexpr uint32_t kCloudSeeds = 1;
constexpr int64_t kCells = 60;
constexpr size_t kPoints = 500;

struct Shape {
  std::string name;
  TriangleMesh (*make)();
};

// About two units large each.
std::vector<Shape> Shapes() {
  return {{"Box",
           [] {
             return fixtures::MakeBox({1.5, 1, 1}, 0.25);
           }},
          {"Cylinder", [] { return fixtures::MakeCylinder(0.6, 1.2, 0.25); }},
          {"Torus", [] { return fixtures::MakeTorus(0.9, 0.4, 0.25); }}};
}

void ExpectValidOrRefused(const InputHull& hull, bool must_fail) {
  MeshingParams params;
  params.sizing.trial_count = 1;  // what the input is matters here, not how good the mesh
  params.sizing.cell_count = kCells;
  params.run.backend = Backend::kCpu;
  RunContext run;
  absl::StatusOr<MeshingResult> result = Mesh(hull, params, run);
  if (must_fail) {
    EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument) << result.status();
  } else {
    ASSERT_TRUE(result.ok()) << result.status();
    // The laws add up volumes about the origin, which may be very far away.
    const Vec3d corner = result->mesh.vertices.front();
    for (Vec3d& p : result->mesh.vertices) p -= corner;
    EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
    EXPECT_GT(result->statistics.volume, 0);
  }
}

using Case = std::tuple<size_t, size_t>;  // shape, damage

class DamagedMesh : public testing::TestWithParam<Case> {};

TEST_P(DamagedMesh, EndsInAValidMeshOrTheRightError) {
  const auto [shape, damage] = GetParam();
  for (uint32_t seed = 1; seed <= kMeshSeeds; ++seed) {
    SCOPED_TRACE(seed);
    fixtures::Chance chance(seed);
    TriangleMesh mesh = Shapes()[shape].make();
    fixtures::MeshDamages()[damage].apply(&mesh, &chance);
    ExpectValidOrRefused(mesh, fixtures::MeshDamages()[damage].must_fail);
  }
}

INSTANTIATE_TEST_SUITE_P(AllShapes, DamagedMesh,
                         testing::Combine(testing::Range(size_t{0}, Shapes().size()),
                                          testing::Range(size_t{0},
                                                         fixtures::MeshDamages().size())),
                         [](const testing::TestParamInfo<Case>& instance) {
                           return Shapes()[std::get<0>(instance.param)].name +
                                  fixtures::MeshDamages()[std::get<1>(instance.param)].name;
                         });

class DamagedCloud : public testing::TestWithParam<Case> {};

TEST_P(DamagedCloud, EndsInAValidMeshOrTheRightError) {
  const auto [shape, damage] = GetParam();
  for (uint32_t seed = 1; seed <= kCloudSeeds; ++seed) {
    SCOPED_TRACE(seed);
    fixtures::Chance chance(seed);
    PointCloud cloud = fixtures::SampleSurface(Shapes()[shape].make(), kPoints, seed);
    fixtures::CloudDamages()[damage].apply(&cloud, &chance);
    ExpectValidOrRefused(cloud, fixtures::CloudDamages()[damage].must_fail);
  }
}

INSTANTIATE_TEST_SUITE_P(AllShapes, DamagedCloud,
                         testing::Combine(testing::Range(size_t{0}, Shapes().size()),
                                          testing::Range(size_t{0},
                                                         fixtures::CloudDamages().size())),
                         [](const testing::TestParamInfo<Case>& instance) {
                           return Shapes()[std::get<0>(instance.param)].name +
                                  fixtures::CloudDamages()[std::get<1>(instance.param)].name;
                         });

}  // namespace
}  // namespace amhex
