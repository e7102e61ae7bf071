#include "input/edges_balance.h"

#include <algorithm>
#include <atomic>

#include "base/counter_rng.h"
#include "base/loop_polling.h"

namespace amhex {
namespace {

constexpr size_t kTrianglesPerBlock = 2048;

// As much one way as, negated, the other.
uint64_t BitsOf(int32_t from, int32_t to) {
  if (from == to) return 0;
  const bool is_forward = from < to;
  const auto low = static_cast<uint64_t>(is_forward ? from : to);
  const auto high = static_cast<uint64_t>(is_forward ? to : from);
  const uint64_t bits = RandomBits(low, RandomStream::kEdgeBalance, high);
  return is_forward ? bits : uint64_t{0} - bits;
}

}  // namespace

bool EdgesBalance(const std::vector<std::array<int32_t, 3>>& triangles, const StopPoll& poll) {
  std::atomic<uint64_t> all{0};
  const size_t blocks = (triangles.size() + kTrianglesPerBlock - 1) / kTrianglesPerBlock;
  ForAllPolling(blocks, 1, poll, [&](size_t block) {
    const size_t end = std::min(triangles.size(), (block + 1) * kTrianglesPerBlock);
    uint64_t sum = 0;
    for (size_t i = block * kTrianglesPerBlock; i < end; ++i) {
      const std::array<int32_t, 3>& t = triangles[i];
      sum += BitsOf(t[0], t[1]) + BitsOf(t[1], t[2]) + BitsOf(t[2], t[0]);
    }
    all.fetch_add(sum, std::memory_order_relaxed);
  });
  return all.load() == 0;
}

}  // namespace amhex
