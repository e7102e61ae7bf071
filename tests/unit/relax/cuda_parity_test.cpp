// The CUDA backend against the CPU's, to the bit; skipped where no device is usable.
#include <gtest/gtest.h>

#include <ostream>
#include <string>

#include "cuda/cuda_library.h"
#include "fixtures/solids.h"
#include "input/site_grid.h"
#include "relax/relaxation.h"
#include "unit/relax/relax_fixtures.h"

namespace amhex {
namespace {

struct ParityCase {
  const char* name;
  TriangleMesh solid;
  int32_t iteration_count;
  int32_t lattice_points_per_site;
};

void PrintTo(const ParityCase& c, std::ostream* out) { *out << c.name; }

class CudaParity : public testing::TestWithParam<ParityCase> {};

absl::StatusOr<Sites> RelaxWith(Backend backend, const ParityCase& c) {
  MeshingParams params;
  params.run.backend = backend;
  params.relaxation.initialization = Initialization::kJitteredGrid;
  params.relaxation.iteration_count = c.iteration_count;
  params.relaxation.lattice_points_per_site = c.lattice_points_per_site;
  // Splits happen early enough to be part of the comparison.
  params.relaxation.split_limit = 8;
  const Hull hull = testing_support::HullOfMesh(c.solid);
  const HullSamples samples = SamplesOf(hull);
  RunContext run;
  absl::StatusOr<Sites> sites = PopulateGrid(hull, samples, params, run);
  if (!sites.ok()) return sites.status();
  return RelaxSites(hull, samples, *std::move(sites), params, run);
}

TEST_P(CudaParity, GivesTheSameBitsAsTheCpu) {
  const absl::StatusOr<std::string> device = DescribeCuda();
  if (!device.ok()) GTEST_SKIP() << std::string(device.status().message());
  const absl::StatusOr<Sites> cpu = RelaxWith(Backend::kCpu, GetParam());
  const absl::StatusOr<Sites> cuda = RelaxWith(Backend::kCuda, GetParam());
  ASSERT_TRUE(cpu.ok()) << cpu.status();
  ASSERT_TRUE(cuda.ok()) << cuda.status();
  ASSERT_EQ(cpu->count(), cuda->count());
  EXPECT_EQ(cpu->cell_volume, cuda->cell_volume);
  EXPECT_EQ(cpu->position, cuda->position);
  for (size_t i = 0; i < cpu->frame.size(); ++i) {
    EXPECT_EQ(cpu->frame[i].axis, cuda->frame[i].axis) << "site " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Solids, CudaParity,
    testing::Values(ParityCase{"LabellingAlone", fixtures::MakeTorus(4, 1.5, 0.5), 0, 108},
                    ParityCase{"OneIteration", fixtures::MakeTorus(4, 1.5, 0.5), 1, 108},
                    ParityCase{"CoarseLattice", fixtures::MakeSphere(4, 0.5), 20, 8},
                    ParityCase{"PaperLattice", fixtures::MakeSphere(3, 0.5), 10, 1728},
                    ParityCase{"Twisted", fixtures::MakeTwistedBox({5, 5, 8}, 1.0, 0.6), 20, 108}),
    [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace amhex
