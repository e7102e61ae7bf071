// Every defect of fixtures/damage.h on several solids: a valid mesh or the right
// error.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <string>
#include <tuple>
#include <variant>
#include <vector>

#include "amhex/mesher.h"
#include "fixtures/damage.h"
#include "fixtures/solids.h"
#include "support/mesh_invariants.h"
#include "support/surface_measures.h"

namespace amhex {
namespace {

using ::testing::IsEmpty;
using testing_support::BrokenLaws;

constexpr uint32_t kMeshSeeds = 2;
constexpr uint32_t kCloudSeeds = 1;
constexpr int64_t kDamagedCells = 60;
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

// The boundary of a mesh as triangles.
TriangleMesh BoundaryOf(const AtMostHexaMesh& mesh) {
  TriangleMesh boundary{mesh.vertices, {}};
  for (const testing_support::Polygon& face : testing_support::BoundaryPolygons(mesh)) {
    for (size_t i = 2; i < face.size(); ++i) {
      boundary.triangles.push_back({face[0], face[i - 1], face[i]});
    }
  }
  return boundary;
}

// Looked for on a grid of each triangle, so it is never less than the true distance.
double DistanceTo(const TriangleMesh& surface, const Vec3d& p) {
  constexpr int kParts = 4;
  double least = std::numeric_limits<double>::max();
  for (const auto& t : surface.triangles) {
    const Vec3d& a = testing_support::Corner(surface, t, 0);
    const Vec3d u = (testing_support::Corner(surface, t, 1) - a) / kParts;
    const Vec3d v = (testing_support::Corner(surface, t, 2) - a) / kParts;
    for (int i = 0; i <= kParts; ++i) {
      for (int j = 0; i + j <= kParts; ++j) {
        least = std::min(least, Norm(a + u * i + v * j - p));
      }
    }
  }
  return least;
}

// By the sum of the solid angles.
bool IsInside(const TriangleMesh& surface, const Vec3d& p) {
  double angle = 0;
  for (const auto& t : surface.triangles) {
    const Vec3d a = testing_support::Corner(surface, t, 0) - p;
    const Vec3d b = testing_support::Corner(surface, t, 1) - p;
    const Vec3d c = testing_support::Corner(surface, t, 2) - p;
    const double x = Norm(a), y = Norm(b), z = Norm(c);
    angle += 2 * std::atan2(Determinant(a, b, c),
                            x * y * z + Dot(a, b) * z + Dot(b, c) * x + Dot(c, a) * y);
  }
  return angle > 2 * std::numbers::pi;
}

// What the mesh leaves out by more than an edge length is told by the statistics.
void ExpectMissedCornersAreTold(const TriangleMesh& input, const Vec3d& origin,
                                const MeshingResult& result) {
  constexpr double kSurelyMissed = 1.3;  // edge lengths, for the distance is only looked for
  const TriangleMesh boundary = BoundaryOf(result.mesh);
  std::set<int32_t> used;
  for (const auto& t : input.triangles) used.insert(t.begin(), t.end());
  for (const int32_t v : used) {
    const Vec3d p = input.vertices[static_cast<size_t>(v)] - origin;
    if (DistanceTo(boundary, p) < kSurelyMissed * result.statistics.edge_length) continue;
    if (IsInside(boundary, p)) continue;
    EXPECT_TRUE(result.statistics.distance_exceeds_cell) << "vertex " << v;
    return;
  }
}

void ExpectValidOrRefused(const InputHull& hull, bool must_fail) {
  MeshingParams params;
  params.sizing.trial_count = 1;  // what the input is matters here, not how good the mesh
  params.sizing.cell_count = kDamagedCells;
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
    if (const auto* mesh = std::get_if<TriangleMesh>(&hull)) {
      ExpectMissedCornersAreTold(*mesh, corner, *result);
    }
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

TEST(SmallestMesh, FourTrianglesAreEnough) {
  TriangleMesh tetrahedron;
  tetrahedron.vertices = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2}};
  tetrahedron.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  ExpectValidOrRefused(tetrahedron, false);
}

}  // namespace
}  // namespace amhex
