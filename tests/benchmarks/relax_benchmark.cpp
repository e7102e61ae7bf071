// Cost of the relaxation's parts per site. One axis varies at a time: number of sites, lattice
// points per site. Counters are sites or lattice points per second.
#include <benchmark/benchmark.h>

#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "amhex/params.h"
#include "amhex/run_context.h"
#include "base/array_view_of.h"
#include "cuda/cuda_library.h"
#include "exec/cpu_executor.h"
#include "fixtures/solids.h"
#include "graph/grid_bins.h"
#include "graph/knn_exact_body.h"
#include "input/site_grid.h"
#include "relax/build_barrier.h"
#include "relax/label_body.h"
#include "relax/relaxation.h"
#include "support/hull_of_mesh.h"

namespace amhex {
namespace {

constexpr int64_t kDefaultSites = 8000;
constexpr int64_t kDefaultPointsPerSite = 108;

// A sphere that holds about `site_count` unit cells.
Hull SphereFor(int64_t site_count) {
  const double radius = std::cbrt(static_cast<double>(site_count) / (4.0 / 3.0 * 3.14159265));
  return testing_support::HullOfMesh(fixtures::MakeSphere(radius, 1.0));
}

HullSamples SamplesOf(const Hull& hull) {
  HullSamples samples;
  for (size_t t = 0; t < hull.triangles.size(); ++t) {
    Vec3d centre;
    for (const int32_t v : hull.triangles[t]) centre += hull.vertices[static_cast<size_t>(v)];
    samples.position.push_back(centre / 3.0);
    samples.normal.push_back(hull.triangle_normals[t]);
    samples.tangent.push_back({});
    samples.curvature_confidence.push_back(0.0f);
  }
  return samples;
}

MeshingParams JitteredParams() {
  MeshingParams params;
  params.run.backend = Backend::kCpu;
  params.relaxation.initialization = Initialization::kJitteredGrid;
  return params;
}

Sites JitteredSites(const Hull& hull) {
  RunContext run;
  return *PopulateGrid(hull, SamplesOf(hull), JitteredParams(), run);
}

// Sites of both sides of a sphere's hull, ready to be labelled.
struct Diagram {
  HullBarrier barrier;
  std::vector<LabelItem> items;
  CpuExecutor executor;
  std::vector<Vec3f> position;
  std::unique_ptr<GridBins<CpuExecutor>> bins;
  std::vector<SiteMetric> metric;  // by slot
  std::vector<CellMoments> moments;

  Diagram(int64_t site_count, int64_t points_per_site) {
    constexpr double kMargin = 3.0;
    const Hull hull = SphereFor(site_count);
    RunContext run;
    barrier = *BuildHullBarrier(hull, static_cast<double>(points_per_site), kMargin, run);
    std::vector<Vec3d> sites, outside;
    std::vector<int32_t> is_inside;
    for (const Vec3d& p : JitteredSites(hull).position) {
      sites.push_back(p - barrier.origin);
      position.push_back(ToFloat(sites.back()));
      is_inside.push_back(barrier.View().IsInside(sites.back()) ? 1 : 0);
      if (is_inside.back() == 0) outside.push_back(sites.back());
    }
    const std::vector<Quatf> orientation(sites.size(), Normalized(Quatf{1, 0.2f, 0.1f, 0.3f}));
    const std::vector<Vec3f> size(sites.size(), Vec3f{1, 1, 1});
    metric.resize(sites.size());
    moments.resize(sites.size());
    const auto count = static_cast<int64_t>(sites.size());
    bins = std::make_unique<GridBins<CpuExecutor>>(executor, barrier.extent, 1.0f);
    const BinGrid& grid = bins->Build(ArrayViewOf(position), count);
    const SiteMetricBody body{barrier.lattice.spacing,  grid.ids,          ArrayViewOf(sites),
                              ArrayViewOf(orientation), ArrayViewOf(size), ArrayViewOf(is_inside),
                              {metric.data(), count}};
    for (size_t i = 0; i < sites.size(); ++i) body(static_cast<int64_t>(i));
    items = ListLabelItems(barrier, outside);
  }
};

void BM_NearestNeighbours(benchmark::State& state) {
  const Hull hull = SphereFor(state.range(0));
  std::vector<Vec3f> position;
  for (const Vec3d& p : JitteredSites(hull).position) {
    position.push_back(ToFloat(p - hull.box.low + Vec3d{3, 3, 3}));
  }
  const auto count = static_cast<int64_t>(position.size());
  std::vector<int32_t> neighbours(position.size() * kNeighbourCount);
  CpuExecutor executor;
  GridBins<CpuExecutor> bins(executor, hull.box.Extent() + Vec3d{6, 6, 6}, 1.0f);
  for (auto _ : state) {
    executor.ForEach("knn", count,
                     KnnExactBody{bins.Build(ArrayViewOf(position), count),
                                  ArrayViewOf(position),
                                  {neighbours.data(), static_cast<int64_t>(neighbours.size())}});
    benchmark::DoNotOptimize(neighbours.data());
  }
  state.SetItemsProcessed(state.iterations() * count);
}
BENCHMARK(BM_NearestNeighbours)->Arg(1000)->Arg(kDefaultSites)->Arg(64000)->UseRealTime();

void BM_LabelLattice(benchmark::State& state) {
  Diagram diagram(state.range(0), state.range(1));
  const auto count = static_cast<int64_t>(diagram.position.size());
  LabelTileBody body;
  body.barrier = diagram.barrier.View();
  body.items = ArrayViewOf(diagram.items);
  body.metric = ArrayViewOf(diagram.metric);
  body.moments = {diagram.moments.data(), count};
  body.bins = diagram.bins->grid();
  for (auto _ : state) {
    diagram.executor.ForEach("label", static_cast<int64_t>(diagram.items.size()), body);
    benchmark::DoNotOptimize(diagram.moments.data());
  }
  state.SetItemsProcessed(state.iterations() * count);
  state.counters["lattice_points"] =
      benchmark::Counter(static_cast<double>(state.iterations() * count * state.range(1)),
                         benchmark::Counter::kIsRate);
}
BENCHMARK(BM_LabelLattice)
    ->Args({1000, kDefaultPointsPerSite})
    ->Args({kDefaultSites, 32})
    ->Args({kDefaultSites, kDefaultPointsPerSite})
    ->Args({kDefaultSites, 1728})
    ->Args({64000, kDefaultPointsPerSite})
    ->UseRealTime();

// Whole relaxations; items are iterations of one site, so the rate should not depend on the size.
void BM_Relax(benchmark::State& state) {
  constexpr int32_t kIterations = 10;
  const Hull hull = SphereFor(state.range(0));
  const HullSamples samples = SamplesOf(hull);
  const Sites start = JitteredSites(hull);
  MeshingParams params = JitteredParams();
  params.relaxation.iteration_count = kIterations;
  for (auto _ : state) {
    RunContext run;
    const auto relaxed = RelaxSites(hull, samples, start, params, run);
    if (!relaxed.ok()) {
      state.SkipWithError("the relaxation failed");
      break;
    }
    benchmark::DoNotOptimize(relaxed->position.data());
  }
  state.SetItemsProcessed(state.iterations() * start.count() * kIterations);
}
BENCHMARK(BM_Relax)->Arg(1000)->Arg(kDefaultSites)->Unit(benchmark::kMillisecond)->UseRealTime();

// Time per iteration on a CUDA device, from the first report to the last: what the device does,
// without the preparation on the host. Skipped with the reason where no device is usable.
void BM_RelaxOnDevice(benchmark::State& state) {
  const absl::StatusOr<std::string> device = DescribeCuda();
  if (!device.ok()) {
    state.SkipWithError(std::string(device.status().message()).c_str());
    return;
  }
  constexpr int32_t kIterations = 150;
  const Hull hull = SphereFor(state.range(0));
  const HullSamples samples = SamplesOf(hull);
  MeshingParams params = JitteredParams();
  params.run.backend = Backend::kCuda;
  params.relaxation.iteration_count = kIterations;
  params.relaxation.lattice_points_per_site = static_cast<int32_t>(state.range(1));
  const Sites start = JitteredSites(hull);
  for (auto _ : state) {
    RunContext run;
    RunContext::Clock::time_point first, last;
    run.on_progress = [&](const Progress& progress) {
      last = RunContext::Clock::now();
      if (progress.iteration == 1) first = last;
    };
    if (const auto relaxed = RelaxSites(hull, samples, start, params, run); !relaxed.ok()) {
      state.SkipWithError(std::string(relaxed.status().message()).c_str());
      return;
    }
    state.SetIterationTime(std::chrono::duration<double>(last - first).count() / (kIterations - 1));
  }
  state.SetLabel(*device);
  state.SetItemsProcessed(state.iterations() * start.count());
}
BENCHMARK(BM_RelaxOnDevice)
    ->Args({10000, kDefaultPointsPerSite})
    ->Args({225000, kDefaultPointsPerSite})
    ->Args({225000, 1728})
    ->Args({1000000, kDefaultPointsPerSite})
    ->Args({10000000, kDefaultPointsPerSite})
    ->Iterations(3)
    ->Unit(benchmark::kMillisecond)
    ->UseManualTime();

void BM_BuildHullBarrier(benchmark::State& state) {
  const Hull hull = SphereFor(state.range(0));
  RunContext run;
  for (auto _ : state) {
    const auto barrier = BuildHullBarrier(hull, kDefaultPointsPerSite, 3.0, run);
    benchmark::DoNotOptimize(barrier->inside_mask.data());
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(BM_BuildHullBarrier)->Arg(kDefaultSites)->Arg(64000)->UseRealTime();

}  // namespace
}  // namespace amhex
