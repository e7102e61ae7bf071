// Samples of the hull taken on a device against the host's, to the bit; skipped where no device is
// usable.
#include <gtest/gtest.h>

#include <string>

#include "cuda/cuda_library.h"
#include "fixtures/solids.h"
#include "input/build_hull.h"
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

// With and without sharp edges, with thin walls, and with large and small triangles.
TEST(CudaParityOfSampling, TakesTheSameSamplesAsTheCpu) {
  const absl::StatusOr<std::string> device = DescribeCuda();
  if (!device.ok()) GTEST_SKIP() << std::string(device.status().message());
  for (const TriangleMesh& mesh :
       {fixtures::MakeBracket(1, 0.2), fixtures::MakeSphere(1, 0.1),
        fixtures::MakeBox({2, 1, 1}, 5), fixtures::MakeBox({1, 1, 0.05}, 0.1),
        fixtures::MakeTwistedBox({3, 2, 4}, 1.0, 0.4)}) {
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
