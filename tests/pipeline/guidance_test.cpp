// Guide samples and planes through the whole engine: they align the cells and bound nothing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "amhex/mesher.h"
#include "fixtures/solids.h"
#include "support/mesh_invariants.h"
#include "support/surface_measures.h"

namespace amhex {
namespace {

using ::testing::Contains;
using ::testing::IsEmpty;
using testing_support::BrokenLaws;
using testing_support::CellPolygons;
using testing_support::MeasureBoundary;

// Five edge lengths from its middle to its surface, where nothing asks for a direction.
TriangleMesh Ball() { return fixtures::MakeSphere(1, 0.15); }
const Vec3d kDirection = Normalized(Vec3d{1, 2, 4});

MeshingResult MeshOf(const Guidance& guidance) {
  MeshingParams params;
  params.sizing.cell_count = 600;
  params.sizing.trial_count = 1;
  params.run.backend = Backend::kCpu;
  RunContext run;
  absl::StatusOr<MeshingResult> result = Mesh(MeshingInput{Ball(), guidance}, params, run);
  EXPECT_TRUE(result.ok()) << result.status();
  if (!result.ok()) return {};
  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  return *std::move(result);
}

// The edge of each cell in the middle of the ball that is most parallel to the direction: the mean
// cosine.
double AlignmentOf(const MeshingResult& result) {
  double sum = 0;
  int64_t count = 0;
  for (const CellCorners& corners : result.mesh.corners) {
    Vec3d centre;
    for (const int32_t v : corners) centre += result.mesh.vertices[static_cast<size_t>(v)] / 8.0;
    if (Norm(centre) > 0.45) continue;
    double best = 0;
    for (const auto& face : CellPolygons(corners)) {
      for (size_t i = 0; i < face.size(); ++i) {
        const Vec3d& a = result.mesh.vertices[static_cast<size_t>(face[i])];
        const Vec3d& b = result.mesh.vertices[static_cast<size_t>(face[(i + 1) % face.size()])];
        best = std::max(best, std::abs(Dot(Normalized(b - a), kDirection)));
      }
    }
    sum += best;
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

void ExpectTheBallAlone(const MeshingResult& result) {
  const double volume = testing_support::EnclosedVolume(Ball());
  EXPECT_NEAR(result.statistics.volume, volume, 0.08 * volume);
  EXPECT_EQ(MeasureBoundary(result.mesh).component_count, 1);
  EXPECT_EQ(MeasureBoundary(result.mesh).euler_number, 2);
  EXPECT_FALSE(result.statistics.distance_exceeds_cell);
}

TEST(Guidance, APlaneAlignsTheCellsAndCutsNothing) {
  Guidance guidance;
  guidance.planes.push_back({{}, kDirection});
  const MeshingResult guided = MeshOf(guidance);
  EXPECT_GT(AlignmentOf(guided), 0.99);
  EXPECT_LT(AlignmentOf(MeshOf({})), 0.98);
  ExpectTheBallAlone(guided);
}

TEST(Guidance, SamplesAlignTheCellsAndBoundNothing) {
  Guidance guidance;
  const Vec3d u = Normalized(Cross(kDirection, {1, 0, 0})), v = Cross(kDirection, u);
  for (int i = -4; i <= 4; ++i) {
    for (int j = -4; j <= 4; ++j) {
      guidance.samples.push_back({u * (0.1 * i) + v * (0.1 * j), kDirection, {}});
    }
  }
  const MeshingResult guided = MeshOf(guidance);
  EXPECT_GT(AlignmentOf(guided), 0.99);
  EXPECT_THAT(guided.warnings, IsEmpty());
  ExpectTheBallAlone(guided);
}

TEST(Guidance, SamplesFarOutsideChangeNothingAndAreToldOf) {
  Guidance guidance;
  guidance.samples.push_back({{9, 0, 0}, kDirection, {}});
  guidance.samples.push_back({{0, -9, 0}, kDirection, {}});
  const MeshingResult free = MeshOf({}), guided = MeshOf(guidance);
  EXPECT_EQ(guided.mesh.vertices, free.mesh.vertices);
  EXPECT_EQ(guided.mesh.corners, free.mesh.corners);
  EXPECT_THAT(guided.warnings, Contains("guide samples outside the solid: 2"));
}

}  // namespace
}  // namespace amhex
