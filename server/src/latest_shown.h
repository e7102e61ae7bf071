// What many threads find out and show, so that what is shown last is what was found last.
#pragma once

#include <functional>
#include <mutex>
#include <utility>

namespace amhex::server {

// Looks and shows as one step: of two that overlap, one would else show what has passed after the
// other has shown what came. Thread-safe; `look` and `show` run under its lock.
template <typename State>
class LatestShown {
 public:
  LatestShown(std::function<State()> look, std::function<void(const State&)> show)
      : look_(std::move(look)), show_(std::move(show)) {}

  // To be called after each change of what `look` returns.
  void Refresh() {
    std::lock_guard<std::mutex> lock(mutex_);
    show_(look_());
  }

 private:
  std::mutex mutex_;
  const std::function<State()> look_;
  const std::function<void(const State&)> show_;
};

}  // namespace amhex::server
