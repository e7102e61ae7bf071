// The relaxation on a CUDA device where neighbours and owners are found in other ways than mostly,
// against the CPU's, to the bit; skipped where no device is usable.
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "cuda/cuda_library.h"
#include "fixtures/solids.h"
#include "input/site_grid.h"
#include "relax/relaxation.h"
#include "unit/relax/relax_fixtures.h"

namespace amhex {
namespace {

// A grid of sites, so that many are equally far, of which one side is thinned out, the other filled
// up, and one site there thirty times in the same place.
Sites UnevenSites(const Hull& hull, const HullSamples& samples) {
  constexpr double kSparseBelow = -0.5, kDenseFrom = 1.2, kSpread = 0.8;
  constexpr size_t kKeptOfSparse = 7, kCopies = 10, kInOnePlace = 30;
  MeshingParams params;
  params.run.backend = Backend::kCpu;
  params.relaxation.initialization = Initialization::kGrid;
  RunContext run;
  const Sites grid = *PopulateGrid(hull, samples, params, run);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> offset(-kSpread / 2, kSpread / 2);
  Sites sites;
  const auto add = [&](size_t i, const Vec3d& position) {
    sites.position.push_back(position);
    sites.frame.push_back(grid.frame[i]);
    sites.size.push_back(grid.size[i]);
    sites.cell_volume.push_back(0);
  };
  for (size_t i = 0; i < grid.position.size(); ++i) {
    const Vec3d& p = grid.position[i];
    if (p.x < kSparseBelow && i % kKeptOfSparse != 0) continue;
    add(i, p);
    if (p.x < kDenseFrom) continue;
    for (size_t copy = 0; copy < kCopies; ++copy) {
      add(i, p + Vec3d{offset(random), offset(random), offset(random)});
    }
  }
  for (size_t copy = 0; copy < kInOnePlace; ++copy) add(0, {0.1, 0.2, 0.3});
  return sites;
}

TEST(CudaParityOfUnevenSites, HoldsWhereSitesAreDenseSparseOrEquallyFar) {
  const absl::StatusOr<std::string> device = DescribeCuda();
  if (!device.ok()) GTEST_SKIP() << std::string(device.status().message());
  const Hull hull = testing_support::HullOfMesh(fixtures::MakeSphere(3, 0.5));
  const HullSamples samples = SamplesOf(hull);
  const Sites start = UnevenSites(hull, samples);
  for (const int32_t points_per_site : {8, 108, 1728}) {
    const auto relaxed = [&](Backend backend) {
      MeshingParams params;
      params.run.backend = backend;
      params.relaxation.initialization = Initialization::kGrid;
      params.relaxation.iteration_count = 2;
      params.relaxation.lattice_points_per_site = points_per_site;
      RunContext run;
      return RelaxSites(hull, samples, start, params, run);
    };
    const absl::StatusOr<Sites> cpu = relaxed(Backend::kCpu), cuda = relaxed(Backend::kCuda);
    ASSERT_TRUE(cpu.ok()) << cpu.status();
    ASSERT_TRUE(cuda.ok()) << cuda.status();
    EXPECT_EQ(cpu->cell_volume, cuda->cell_volume) << points_per_site;
    EXPECT_EQ(cpu->position, cuda->position) << points_per_site;
    ASSERT_EQ(cpu->frame.size(), cuda->frame.size());
    for (size_t i = 0; i < cpu->frame.size(); ++i) {
      ASSERT_EQ(cpu->frame[i].axis, cuda->frame[i].axis) << "site " << i;
    }
  }
}

}  // namespace
}  // namespace amhex
