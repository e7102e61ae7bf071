// How long the engine takes, one axis at a time around one central case: the bracket at
// kCentralCellCount cells on all cores. Stages appear as counters in seconds per run, the CPU
// column is that of all threads.
//
//   engine_benchmarks --benchmark_filter=ByCells --benchmark_out=FILE --benchmark_out_format=json
//
// The largest runs take minutes and gigabytes: --benchmark_filter=LargeMesh/200000. peak_MiB is the
// whole process's so far, so it says something of the first run only.
#include <benchmark/benchmark.h>

#include <numbers>
#include <string>

#include "amhex/mesher.h"
#include "cuda/cuda_library.h"
#include "fixtures/solids.h"
#include "optimize/cell_quality.h"

namespace amhex {
namespace {

constexpr int64_t kCentralCellCount = 2000;
constexpr int64_t kScalingCellCount = 10000;
constexpr double kSpacing = 0.1;  // of the input's triangles; the solids are one to six units wide

MeshingParams ParamsFor(int64_t cell_count) {
  MeshingParams params;
  params.sizing.cell_count = cell_count;
  params.run.backend = Backend::kCpu;
  return params;
}

void MeshRepeatedly(benchmark::State& state, const InputHull& hull, const MeshingParams& params) {
  int64_t cell_count = 0;
  for (auto _ : state) {
    RunContext run;
    const absl::StatusOr<MeshingResult> result = Mesh(hull, params, run);
    if (!result.ok()) {
      state.SkipWithError(std::string(result.status().message()).c_str());
      return;
    }
    cell_count += result->statistics.cell_count;
    for (const StageReport& stage : result->stages) {
      state.counters[StageName(stage.stage)] += stage.wall_seconds;
    }
    state.counters["peak_MiB"] =
        static_cast<double>(result->stages.back().peak_memory_bytes) / (1 << 20);
    state.counters["hexahedra_ratio"] = result->statistics.hexahedra_ratio;
    state.counters["min_scaled_jacobian"] = result->statistics.min_scaled_jacobian;
  }
  for (int i = 0; i < kStageCount; ++i) {
    state.counters[StageName(static_cast<Stage>(i))].flags = benchmark::Counter::kAvgIterations;
  }
  state.counters["cells/s"] =
      benchmark::Counter(static_cast<double>(cell_count), benchmark::Counter::kIsRate);
}

void MeshByCells(benchmark::State& state) {
  MeshRepeatedly(state, fixtures::MakeBracket(1, kSpacing), ParamsFor(state.range(0)));
}
BENCHMARK(MeshByCells)
    ->RangeMultiplier(2)
    ->Range(500, 16000)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

// Cells from 5,000 up to a million: time and memory per cell should stay what they are.
void LargeMesh(benchmark::State& state) {
  MeshRepeatedly(state, fixtures::MakeBracket(1, kSpacing), ParamsFor(state.range(0)));
}
BENCHMARK(LargeMesh)
    ->Arg(5'000)
    ->Arg(50'000)
    ->Arg(200'000)
    ->Arg(1'000'000)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

// Whole meshes with a CUDA device for all that can run there. Skipped with the reason where no
// device is usable.
void MeshOnDevice(benchmark::State& state) {
  const absl::StatusOr<std::string> device = DescribeCuda();
  if (!device.ok()) {
    state.SkipWithError(std::string(device.status().message()).c_str());
    return;
  }
  MeshingParams params = ParamsFor(state.range(0));
  params.run.backend = Backend::kCuda;
  state.SetLabel(*device);
  MeshRepeatedly(state, fixtures::MakeBracket(1, kSpacing), params);
}
BENCHMARK(MeshOnDevice)
    ->Arg(5'000)
    ->Arg(50'000)
    ->Arg(100'000)
    ->Arg(1'000'000)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

void MeshByThreads(benchmark::State& state) {
  MeshingParams params = ParamsFor(kScalingCellCount);
  params.run.thread_count = static_cast<int32_t>(state.range(0));
  MeshRepeatedly(state, fixtures::MakeBracket(1, kSpacing), params);
}
BENCHMARK(MeshByThreads)
    ->RangeMultiplier(2)
    ->Range(1, 16)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void MeshByInputSize(benchmark::State& state) {
  const double spacing = 1.0 / static_cast<double>(state.range(0));
  const TriangleMesh bracket = fixtures::MakeBracket(1, spacing);
  state.counters["triangles"] = static_cast<double>(bracket.triangles.size());
  MeshRepeatedly(state, bracket, ParamsFor(kCentralCellCount));
}
BENCHMARK(MeshByInputSize)
    ->RangeMultiplier(2)
    ->Range(4, 64)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void MeshByInitialization(benchmark::State& state) {
  MeshingParams params = ParamsFor(kCentralCellCount);
  params.relaxation.initialization = static_cast<Initialization>(state.range(0));
  state.SetLabel(state.range(0) == 0 ? "field" : "grid");
  MeshRepeatedly(state, fixtures::MakeBracket(1, kSpacing), params);
}
BENCHMARK(MeshByInitialization)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond)->UseRealTime();

void MeshBySolid(benchmark::State& state, const TriangleMesh& solid) {
  MeshRepeatedly(state, solid, ParamsFor(kCentralCellCount));
}
BENCHMARK_CAPTURE(MeshBySolid, box, fixtures::MakeBox({2, 1, 1}, kSpacing))
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(MeshBySolid, sphere, fixtures::MakeSphere(1, kSpacing))
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(MeshBySolid, cylinder, fixtures::MakeCylinder(1, 2, kSpacing))
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(MeshBySolid, torus, fixtures::MakeTorus(1, 0.4, kSpacing))
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(MeshBySolid, twisted_box,
                  fixtures::MakeTwistedBox({1, 1, 2}, std::numbers::pi / 2, kSpacing))
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void MeshCloudByPoints(benchmark::State& state) {
  const double spacing = 1.0 / static_cast<double>(state.range(0));
  const PointCloud cloud = fixtures::SampleCentres(fixtures::MakeBracket(1, spacing));
  state.counters["points"] = static_cast<double>(cloud.points.size());
  MeshRepeatedly(state, cloud, ParamsFor(kCentralCellCount));
}
BENCHMARK(MeshCloudByPoints)
    ->RangeMultiplier(2)
    ->Range(8, 32)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

// The innermost loop of closing and vertex placement.
void JudgeOneHexahedron(benchmark::State& state) {
  const std::vector<Vec3d> vertices = {{0, 0, 0},   {1, 0.1, 0}, {1.1, 1, 0}, {0, 1, 0.1},
                                       {0, 0.1, 1}, {1, 0, 1.1}, {1, 1, 1},   {0.1, 1, 1}};
  const CellCorners corners = {0, 1, 2, 3, 4, 5, 6, 7};
  for (auto _ : state) benchmark::DoNotOptimize(CellQuality(corners, vertices));
}
BENCHMARK(JudgeOneHexahedron);

}  // namespace
}  // namespace amhex
