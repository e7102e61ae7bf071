// Runs one thread block of a device function on the host, lane by lane, so that kernels are tested
// where no device is. Include it before the kernel's file, in one test file only.
//
// Lanes are fibers: each runs until it must wait for others, and goes on when all of them have
// come; of a warp those of the mask that each of them names. Lanes that wait for different things,
// or leave while others wait, are an error, as they are on a device. A result that changes with
// `Order` shows a missing barrier. Lanes that never wait share one fiber, so that kernels without
// barriers cost no more than a loop.
#pragma once

#include <setjmp.h>
#include <ucontext.h>

#include <algorithm>
#include <array>
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

using WarpValues = std::array<uint64_t, kLanesPerWarp>;

struct Lane {
  jmp_buf place;  // where it waits
  bool is_done = false;
  Wait wait = Wait::kNone;
  int site = 0;          // which call it waits in
  unsigned mask = 0;     // for which lanes of the warp, itself among them
  uint64_t offered = 0;  // to the other ones
  WarpValues received;   // from them, once all have come
};

struct Fiber {
  jmp_buf idle;
  alignas(16) char stack[kStackBytes];
};

class Block {
 public:
  void Run(int lane_count, Order order, const std::function<void()>& body) {
    body_ = &body;
    order_ = order;
    if (lanes_.size() != static_cast<size_t>(lane_count)) {
      lanes_ = std::vector<Lane>(static_cast<size_t>(lane_count));
    }
    for (Lane& lane : lanes_) {
      lane.is_done = false;
      lane.wait = Wait::kNone;
    }
    started_ = 0;
    for (size_t fiber = 0; started_ < lane_count; ++fiber) StartFiber(fiber);
    while (Release()) {
      for (int i = 0; i < lane_count; ++i) {
        current_ = InOrder(i);
        Lane& lane = lanes_[static_cast<size_t>(current_)];
        if (!lane.is_done && lane.wait == Wait::kNone) Resume(lane.place);
      }
    }
    for (const Lane& lane : lanes_) {
      if (!lane.is_done) throw std::logic_error("lanes of a block or warp do not meet");
    }
  }

  int lane_count() const { return static_cast<int>(lanes_.size()); }
  int current() const { return current_; }

  void WaitForBlock(int site) {
    lanes_[static_cast<size_t>(current_)].wait = Wait::kBlock;
    WaitAt(site);
  }

  // Waits for the other lanes of the mask; returns what each of them has offered, zero for others.
  const WarpValues& Exchange(unsigned mask, uint64_t value, int site) {
    Lane& own = lanes_[static_cast<size_t>(current_)];
    own.wait = Wait::kWarp;
    own.mask = mask;
    own.offered = value;
    WaitAt(site);
    return lanes_[static_cast<size_t>(current_)].received;
  }

 private:
  static void Enter();

  void WaitAt(int site) {
    Lane& lane = lanes_[static_cast<size_t>(current_)];
    lane.site = site;
    if (_setjmp(lane.place) == 0) _longjmp(scheduler_, 1);
  }

  int InOrder(int i) const { return order_ == Order::kAscending ? i : lane_count() - 1 - i; }

  // Leaves the scheduler; comes back when a lane waits or a fiber has no more lanes to begin.
  void Resume(jmp_buf& place) {
    if (_setjmp(scheduler_) == 0) _longjmp(place, 1);
  }

  // Runs lanes that have not begun, one after the other, until one of them waits. Fibers stay for
  // later blocks: only making one asks the system.
  void StartFiber(size_t fiber) {
    if (fiber < fibers_.size()) return Resume(fibers_[fiber]->idle);
    fibers_.push_back(std::make_unique<Fiber>());
    making_ = fibers_.back().get();
    ucontext_t context;
    getcontext(&context);
    context.uc_stack.ss_sp = making_->stack;
    context.uc_stack.ss_size = kStackBytes;
    makecontext(&context, &Block::Enter, 0);
    if (_setjmp(scheduler_) == 0) setcontext(&context);
  }

  [[noreturn]] void RunFiber() {
    Fiber& fiber = *making_;
    while (true) {
      RunLanes();
      if (_setjmp(fiber.idle) == 0) _longjmp(scheduler_, 1);
    }
  }

  void RunLanes() {
    while (started_ < lane_count()) {
      current_ = InOrder(started_++);
      (*body_)();
      lanes_[static_cast<size_t>(current_)].is_done = true;
    }
  }

  bool WaitsAt(size_t i, Wait wait, int site) const {
    return !lanes_[i].is_done && lanes_[i].wait == wait && lanes_[i].site == site;
  }

  bool ReleaseBlock() {
    for (size_t i = 0; i < lanes_.size(); ++i) {
      if (!WaitsAt(i, Wait::kBlock, lanes_[0].site)) return false;
    }
    for (Lane& lane : lanes_) lane.wait = Wait::kNone;
    return true;
  }

  // Those whom the lane waits for, if all of them wait for each other.
  bool ReleaseMask(size_t lane) {
    if (lanes_[lane].is_done || lanes_[lane].wait != Wait::kWarp) return false;
    const size_t first = lane / kLanesPerWarp * kLanesPerWarp;
    const unsigned mask = lanes_[lane].mask;
    const auto is_in = [mask](size_t i) { return (mask >> i & 1) != 0; };
    if (!is_in(lane - first)) return false;
    WarpValues offered{};
    for (size_t i = 0; i < kLanesPerWarp; ++i) {
      if (!is_in(i)) continue;
      if (!WaitsAt(first + i, Wait::kWarp, lanes_[lane].site)) return false;
      if (lanes_[first + i].mask != mask) return false;
      offered[i] = lanes_[first + i].offered;
    }
    for (size_t i = 0; i < kLanesPerWarp; ++i) {
      if (!is_in(i)) continue;
      lanes_[first + i].received = offered;
      lanes_[first + i].wait = Wait::kNone;
    }
    return true;
  }

  bool Release() {
    bool has_released = ReleaseBlock();
    for (size_t lane = 0; lane < lanes_.size(); ++lane) has_released |= ReleaseMask(lane);
    return has_released;
  }

  const std::function<void()>* body_ = nullptr;
  Order order_ = Order::kAscending;
  std::vector<Lane> lanes_;
  std::vector<std::unique_ptr<Fiber>> fibers_;
  Fiber* making_ = nullptr;
  jmp_buf scheduler_;
  int started_ = 0;  // lanes that have begun
  int current_ = 0;
};

inline Block the_block;

inline void Block::Enter() { the_block.RunFiber(); }

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

struct BlockSize {
  struct X {
    operator unsigned() const { return static_cast<unsigned>(the_block.lane_count()); }
  } x;
};

struct BlockIndex {
  unsigned x = 0;
};

}  // namespace amhex::lockstep

// CUDA's words, as far as the kernels use them.
// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming)
inline const amhex::lockstep::LaneIndex threadIdx{};
inline const amhex::lockstep::BlockSize blockDim{};
inline amhex::lockstep::BlockIndex blockIdx{};

#define __device__
#define __global__
#define __shared__ static
#define __launch_bounds__(threads, blocks)

// Every call site has a number of its own: lanes must wait in the same one.
#define __syncthreads() amhex::lockstep::the_block.WaitForBlock(__LINE__)
#define __syncwarp(...) \
  amhex::lockstep::the_block.Exchange(0xffffffffu __VA_OPT__(&(__VA_ARGS__)), 0, __LINE__)
#define __ballot_sync(mask, predicate) amhex::lockstep::Ballot(mask, predicate, __LINE__)
#define __shfl_sync(mask, value, lane) amhex::lockstep::Shuffle(mask, value, lane, __LINE__)
#define __shfl_xor_sync(mask, value, bits)                                                    \
  amhex::lockstep::Shuffle(mask, value, (amhex::lockstep::the_block.current() % 32) ^ (bits), \
                           __LINE__)

#define __reduce_or_sync(mask, value) amhex::lockstep::ReduceOr(mask, value, __LINE__)
#define __reduce_add_sync(mask, value) amhex::lockstep::ReduceAdd(mask, value, __LINE__)
#define __reduce_min_sync(mask, value) amhex::lockstep::ReduceMin(mask, value, __LINE__)

inline int __ffs(int bits) { return __builtin_ffs(bits); }
inline int __clz(int bits) { return bits == 0 ? 32 : __builtin_clz(static_cast<unsigned>(bits)); }

template <class T>
T atomicOr(T* target, T value) {
  const T before = *target;
  *target |= value;
  return before;
}
template <class T>
T atomicMax(T* target, T value) {
  const T before = *target;
  *target = std::max(before, value);
  return before;
}
template <class T>
T atomicAdd(T* target, T value) {
  const T before = *target;
  *target += value;
  return before;
}
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)

namespace amhex::lockstep {

inline unsigned Ballot(unsigned mask, bool predicate, int site) {
  const WarpValues& values = the_block.Exchange(mask, predicate ? 1 : 0, site);
  unsigned bits = 0;
  for (int i = 0; i < kLanesPerWarp; ++i) {
    bits |= static_cast<unsigned>(values[static_cast<size_t>(i)]) << i;
  }
  return bits;
}

inline unsigned ReduceOr(unsigned mask, unsigned value, int site) {
  unsigned bits = 0;
  for (const auto& of_lane : the_block.Exchange(mask, Bits(value), site)) {
    bits |= FromBits<unsigned>(of_lane);
  }
  return bits;
}

inline unsigned ReduceAdd(unsigned mask, unsigned value, int site) {
  unsigned sum = 0;
  for (const auto& of_lane : the_block.Exchange(mask, Bits(value), site)) {
    sum += FromBits<unsigned>(of_lane);
  }
  return sum;
}

inline unsigned ReduceMin(unsigned mask, unsigned value, int site) {
  const WarpValues& values = the_block.Exchange(mask, Bits(value), site);
  unsigned least = value;
  for (int i = 0; i < kLanesPerWarp; ++i) {
    if ((mask >> i & 1) == 0) continue;
    least = std::min(least, FromBits<unsigned>(values[static_cast<size_t>(i)]));
  }
  return least;
}

template <class T>
T Shuffle(unsigned mask, T value, int lane, int site) {
  return FromBits<T>(the_block.Exchange(mask, Bits(value), site)[static_cast<size_t>(lane)]);
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
