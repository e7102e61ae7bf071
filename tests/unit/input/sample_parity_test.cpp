// Samples of the hull taken on a device against the host's, to the bit; skipped where no device is
// usable.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <string>

#include "cuda/cuda_library.h"
#include "fixtures/solids.h"
#include "input/build_hull.h"
#include "input/hull_queries.h"
#include "input/sample_hull.h"

namespace amhex {
namespace {

absl::StatusOr<HullSamples> SampleWith(const TriangleMesh& mesh, Backend backend) {
  MeshingParams params;
  params.sizing.cell_count = 2000;
  RunContext run;
  const auto hull = BuildHull(mesh, params, run);
  if (!hull.ok()) return hull.status();
  return SampleHull(*hull, backend, run);
}

// A box one of whose edges is parted on one side alone, with a triangle without area in between.
TriangleMesh BoxWithAFlatTriangle() {
  TriangleMesh box = fixtures::MakeBox({2, 2, 2}, 1);
  const std::array<int32_t, 3> parted = box.triangles[0];
  const auto middle = static_cast<int32_t>(box.vertices.size());
  box.vertices.push_back((box.vertices[parted[0]] + box.vertices[parted[1]]) / 2.0);
  box.triangles[0] = {parted[0], middle, parted[2]};
  box.triangles.push_back({middle, parted[1], parted[2]});
  box.triangles.push_back({parted[0], parted[1], middle});
  return box;
}

// Which the hierarchy leaves out.
TEST(Sampling, TrianglesWithoutAreaChangeNothing) {
  MeshingParams params;
  params.sizing.cell_count = 2000;
  params.run.backend = Backend::kCpu;
  RunContext run;
  const auto hull = BuildHull(BoxWithAFlatTriangle(), params, run);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_LT(hull->queries->view().triangles.size, static_cast<int64_t>(hull->triangles.size()));
  const auto samples = SampleHull(*hull, Backend::kCpu, run);
  ASSERT_TRUE(samples.ok()) << samples.status();
  EXPECT_GT(samples->position.size(), 300U);
  for (size_t i = 0; i < samples->position.size(); ++i) {
    const HullPoint nearest = hull->queries->Closest(samples->position[i]);
    EXPECT_LT(nearest.distance, 1e-9);
    EXPECT_GT(Dot(nearest.normal, samples->normal[i]), 0.999) << i;
  }
}

// With and without sharp edges, with thin walls, and with large and small triangles.
TEST(CudaParityOfSampling, TakesTheSameSamplesAsTheCpu) {
  const absl::StatusOr<std::string> device = DescribeCuda();
  if (!device.ok()) GTEST_SKIP() << std::string(device.status().message());
  for (const TriangleMesh& mesh :
       {fixtures::MakeBracket(1, 0.2), fixtures::MakeSphere(1, 0.1),
        fixtures::MakeBox({2, 1, 1}, 5), fixtures::MakeBox({1, 1, 0.05}, 0.1),
        fixtures::MakeTwistedBox({3, 2, 4}, 1.0, 0.4), BoxWithAFlatTriangle()}) {
    const auto here = SampleWith(mesh, Backend::kCpu), there = SampleWith(mesh, Backend::kCuda);
    ASSERT_TRUE(here.ok()) << here.status();
    ASSERT_TRUE(there.ok()) << there.status();
    EXPECT_GT(here->position.size(), 300U);
    EXPECT_EQ(here->position, there->position);
    EXPECT_EQ(here->normal, there->normal);
    EXPECT_EQ(here->tangent, there->tangent);
    EXPECT_EQ(here->curvature_confidence, there->curvature_confidence);
  }
}

}  // namespace
}  // namespace amhex
