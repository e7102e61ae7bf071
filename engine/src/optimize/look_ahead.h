// Steps that are taken one after the other, but found side by side before.
#pragma once

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "amhex/run_context.h"

namespace amhex {

// Steps after the next one that are looked at before their turn.
inline constexpr size_t kMostAhead = 128;

inline size_t ThreadCount() {
  using oneapi::tbb::global_control;
  return global_control::active_value(global_control::max_allowed_parallelism);
}

// One object for one row of steps.
template <class Found, class AreNear, class Look, class Holds, class Take>
class LookAhead {
 public:
  LookAhead(size_t count, const RunContext& run, const AreNear& are_near, const Look& look,
            const Holds& holds, const Take& take)
      : run_(run),
        are_near_(are_near),
        look_(look),
        holds_(holds),
        take_(take),
        state_(count, State::kUnknown),
        found_(count) {}

  void Run() {
    oneapi::tbb::parallel_for(size_t{0}, ThreadCount(), [this](size_t) {
      std::unique_lock lock(mutex_);
      try {
        Work(lock);
      } catch (...) {  // or the others would wait for what is never found
        if (!lock.owns_lock()) lock.lock();
        has_ended_ = true;
        something_was_found_.notify_all();
        throw;
      }
    });
  }

 private:
  enum class State : uint8_t { kUnknown, kLookedAt, kFound };

  // One thread's part, until all steps are taken.
  void Work(std::unique_lock<std::mutex>& lock) {
    while (!has_ended_ && next_ < state_.size()) {
      const size_t i = StepToLookAt();
      if (i == state_.size()) {
        something_was_found_.wait(lock);
        continue;
      }
      state_[i] = State::kLookedAt;
      auto find = look_(i);
      lock.unlock();
      std::optional<Found> found;
      if (!run_.ShouldStop()) found.emplace(find());
      lock.lock();
      found_[i] = std::move(found);
      state_[i] = found_[i].has_value() ? State::kFound : State::kUnknown;
      has_ended_ = has_ended_ || run_.ShouldStop();
      TakeFound();
      something_was_found_.notify_all();
    }
  }

  // The first that no step before is near to; else the first at all: most will not see anything
  // move. The number of steps if there is none.
  size_t StepToLookAt() const {
    const size_t end = std::min(next_ + kMostAhead, state_.size());
    size_t first = state_.size();
    for (size_t i = next_; i < end; ++i) {
      if (state_[i] != State::kUnknown) continue;
      bool is_free = true;
      for (size_t before = next_; before < i && is_free; ++before) is_free = !are_near_(before, i);
      if (is_free) return i;
      first = std::min(first, i);
    }
    return first;
  }

  // Those whose turn it is. What was found and holds no more is forgotten.
  void TakeFound() {
    const size_t end = std::min(next_ + kMostAhead, state_.size());
    while (!has_ended_ && next_ < state_.size() && state_[next_] == State::kFound) {
      if (!holds_(next_, *found_[next_])) break;
      has_ended_ = run_.ShouldStop() || !take_(next_, std::exchange(found_[next_], std::nullopt));
      ++next_;
    }
    for (size_t i = next_; i < end; ++i) {
      if (state_[i] != State::kFound || holds_(i, *found_[i])) continue;
      state_[i] = State::kUnknown;
      found_[i].reset();
    }
  }

  const RunContext& run_;
  const AreNear& are_near_;
  const Look& look_;
  const Holds& holds_;
  const Take& take_;
  std::mutex mutex_;  // of all below, and of what steps change
  std::condition_variable something_was_found_;
  std::vector<State> state_;
  std::vector<std::optional<Found>> found_;
  size_t next_ = 0;
  bool has_ended_ = false;
};

// Steps 0 … count - 1, in turn. look(i) looks at what there is and returns a function, which
// finds the step's Found while others are looked at or taken, and so must not use what these
// change. holds(i, found) tells whether looking now would find the same, or the step comes to
// nothing anyway; take(i, found) makes the step and tells whether others are wanted. `found` holds,
// and is empty where nobody has looked: what take makes must be the same. are_near(i, j) guesses
// whether step i, before j, may change what j finds; a wrong guess costs time only. Ends early when
// the run is to stop.
template <class Found, class AreNear, class Look, class Holds, class Take>
void TakeLookingAhead(size_t count, const RunContext& run, const AreNear& are_near,
                      const Look& look, const Holds& holds, const Take& take) {
  if (ThreadCount() > 1) {
    LookAhead<Found, AreNear, Look, Holds, Take>(count, run, are_near, look, holds, take).Run();
    return;
  }
  for (size_t i = 0; i < count; ++i) {
    if (run.ShouldStop() || !take(i, std::optional<Found>())) return;
  }
}

}  // namespace amhex
