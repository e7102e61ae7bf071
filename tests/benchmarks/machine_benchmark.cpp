// What the machine itself gains from more threads, where they share nothing: no engine can gain
// more than the slower of the two. Threads of a virtual machine may be two of one core.
//
//   engine_benchmarks --benchmark_filter=Machine
#include <benchmark/benchmark.h>

#include <array>
#include <cstdint>
#include <vector>

namespace amhex {
namespace {

// Operations in registers alone, as many side by side as keep a core's units busy.
void MachineArithmetic(benchmark::State& state) {
  constexpr int kSideBySide = 32;
  constexpr int kRounds = 4096;
  std::array<double, kSideBySide> values;
  values.fill(1.0);
  for (auto _ : state) {
    for (int round = 0; round < kRounds; ++round) {
      for (double& value : values) value = value * 0.999999 + 1e-6;
    }
    benchmark::DoNotOptimize(values);
  }
  state.SetItemsProcessed(state.iterations() * kRounds * kSideBySide);
}
BENCHMARK(MachineArithmetic)->ThreadRange(1, 16)->UseRealTime();

// Reads of memory that no cache holds, each thread its own.
void MachineReads(benchmark::State& state) {
  constexpr size_t kNumbers = size_t{1} << 25;  // 256 MiB
  const std::vector<uint64_t> numbers(kNumbers, 1);
  for (auto _ : state) {
    uint64_t sum = 0;
    for (const uint64_t number : numbers) sum += number;
    benchmark::DoNotOptimize(sum);
  }
  state.SetBytesProcessed(state.iterations() *
                          static_cast<int64_t>(kNumbers * sizeof(numbers.front())));
}
BENCHMARK(MachineReads)->ThreadRange(1, 4)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace amhex
