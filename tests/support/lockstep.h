// Runs one thread block of a device function on the host, lane by lane, so that kernels are tested
// where no device is. Include it before the kernel's file, in one test file only.
//
// Lanes are fibers: each runs until it must wait for others, and goes on when all of them have
// come. Lanes that wait for different things, or leave while others wait, are an error, as they
// are on a device. A result that changes with `Order` shows a missing barrier.
#pragma once

#include <ucontext.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <stdexcept>
#include <vector>

namespace amhex::lockstep {

enum class Order { kAscending, kDescending };
enum class Wait { kNone, kWarp, kBlock };

inline constexpr int kLanesPerWarp = 32;
inline constexpr size_t kStackBytes = 128 * 1024;

struct Lane {
  ucontext_t context;
  std::unique_ptr<char[]> stack;
  bool is_done = false;
  Wait wait = Wait::kNone;
  int site = 0;            // which call it waits in
  int parity = 0;          // of the exchanges so far
  uint64_t value[2] = {};  // offered to the other lanes of the warp
};

class Block {
 public:
  void Run(int lane_count, Order order, const std::function<void()>& body) {
    body_ = body;
    if (lanes_.size() != static_cast<size_t>(lane_count)) {
      lanes_ = std::vector<Lane>(static_cast<size_t>(lane_count));
    }
    for (Lane& lane : lanes_) Prepare(lane);
    while (true) {
      bool has_run = false;
      for (int i = 0; i < lane_count; ++i) {
        current_ = order == Order::kAscending ? i : lane_count - 1 - i;
        Lane& lane = lanes_[static_cast<size_t>(current_)];
        if (lane.is_done || lane.wait != Wait::kNone) continue;
        swapcontext(&scheduler_, &lane.context);
        has_run = true;
      }
      const bool has_released = Release();
      if (!has_run && !has_released) break;
    }
    for (const Lane& lane : lanes_) {
      if (!lane.is_done || is_partial_)
        throw std::logic_error("lanes of a block or warp do not meet");
    }
  }

  int current() const { return current_; }
  void Require(unsigned mask) { is_partial_ |= mask != 0xffffffffu; }

  void WaitFor(Wait wait, int site) {
    Lane& lane = lanes_[static_cast<size_t>(current_)];
    lane.wait = wait;
    lane.site = site;
    swapcontext(&lane.context, &scheduler_);
  }

  // Offers a value to the warp and returns every lane's.
  std::vector<uint64_t> Exchange(uint64_t value, int site) {
    Lane& own = lanes_[static_cast<size_t>(current_)];
    const int parity = own.parity;
    own.parity ^= 1;
    own.value[parity] = value;
    WaitFor(Wait::kWarp, site);
    std::vector<uint64_t> values;
    const size_t first = static_cast<size_t>(current_ / kLanesPerWarp * kLanesPerWarp);
    for (size_t i = 0; i < kLanesPerWarp; ++i) values.push_back(lanes_[first + i].value[parity]);
    return values;
  }

 private:
  static void Enter();

  void Prepare(Lane& lane) {
    if (!lane.stack) lane.stack.reset(new char[kStackBytes]);
    lane.is_done = false;
    lane.wait = Wait::kNone;
    getcontext(&lane.context);
    lane.context.uc_stack.ss_sp = lane.stack.get();
    lane.context.uc_stack.ss_size = kStackBytes;
    lane.context.uc_link = &scheduler_;
    makecontext(&lane.context, &Block::Enter, 0);
  }

  bool ReleaseRange(size_t first, size_t count, Wait wait) {
    for (size_t i = first; i < first + count; ++i) {
      if (lanes_[i].is_done || lanes_[i].wait != wait || lanes_[i].site != lanes_[first].site) {
        return false;
      }
    }
    for (size_t i = first; i < first + count; ++i) lanes_[i].wait = Wait::kNone;
    return true;
  }

  bool Release() {
    bool has_released = ReleaseRange(0, lanes_.size(), Wait::kBlock);
    for (size_t first = 0; first < lanes_.size(); first += kLanesPerWarp) {
      has_released |= ReleaseRange(first, kLanesPerWarp, Wait::kWarp);
    }
    return has_released;
  }

  std::function<void()> body_;
  std::vector<Lane> lanes_;
  ucontext_t scheduler_;
  int current_ = 0;
  bool is_partial_ = false;  // a warp was asked for some of its lanes only
};

inline Block the_block;

inline void Block::Enter() {
  the_block.body_();
  the_block.lanes_[static_cast<size_t>(the_block.current_)].is_done = true;
}

template <class T>
uint64_t Bits(T value) {
  static_assert(sizeof(T) <= sizeof(uint64_t));
  uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof(T));
  return bits;
}

template <class T>
T FromBits(uint64_t bits) {
  T value;
  std::memcpy(&value, &bits, sizeof(T));
  return value;
}

struct LaneIndex {
  struct X {
    operator unsigned() const { return static_cast<unsigned>(the_block.current()); }
  } x;
};

struct BlockIndex {
  unsigned x = 0;
};

}  // namespace amhex::lockstep

// CUDA's words, as far as the kernels use them.
inline const amhex::lockstep::LaneIndex threadIdx{};
inline amhex::lockstep::BlockIndex blockIdx{};

#define __device__
#define __global__
#define __shared__ static
#define __launch_bounds__(threads, blocks)

// Every call site has a number of its own: lanes must wait in the same one.
#define __syncthreads() amhex::lockstep::the_block.WaitFor(amhex::lockstep::Wait::kBlock, __LINE__)
#define __syncwarp() amhex::lockstep::the_block.WaitFor(amhex::lockstep::Wait::kWarp, __LINE__)
#define __ballot_sync(mask, predicate) amhex::lockstep::Ballot(mask, predicate, __LINE__)
#define __shfl_sync(mask, value, lane) amhex::lockstep::Shuffle(mask, value, lane, __LINE__)
#define __shfl_xor_sync(mask, value, bits)                                                    \
  amhex::lockstep::Shuffle(mask, value, (amhex::lockstep::the_block.current() % 32) ^ (bits), \
                           __LINE__)

inline int __ffs(int bits) { return __builtin_ffs(bits); }

inline int32_t atomicAdd(int32_t* target, int32_t value) {
  const int32_t before = *target;
  *target += value;
  return before;
}

namespace amhex::lockstep {

inline unsigned Ballot(unsigned mask, bool predicate, int site) {
  the_block.Require(mask);
  const std::vector<uint64_t> values = the_block.Exchange(predicate ? 1 : 0, site);
  unsigned bits = 0;
  for (int i = 0; i < kLanesPerWarp; ++i) {
    bits |= static_cast<unsigned>(values[static_cast<size_t>(i)]) << i;
  }
  return bits;
}

template <class T>
T Shuffle(unsigned mask, T value, int lane, int site) {
  the_block.Require(mask);
  return FromBits<T>(the_block.Exchange(Bits(value), site)[static_cast<size_t>(lane)]);
}

// Runs the blocks of a grid one after the other.
template <class Kernel>
void Launch(int64_t block_count, int lane_count, Order order, const Kernel& kernel) {
  for (int64_t block = 0; block < block_count; ++block) {
    blockIdx.x = static_cast<unsigned>(block);
    the_block.Run(lane_count, order, kernel);
  }
}

}  // namespace amhex::lockstep
