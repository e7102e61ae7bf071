// Forwards a feed's wake-ups to a stream for as long as the stream lives.
#pragma once

#include <functional>
#include <mutex>
#include <utility>

#include "job_feed.h"

namespace amhex::server {

// Thread-safe. The feed may hold it longer than the stream lives.
class FeedWaker final : public FeedListener {
 public:
  explicit FeedWaker(std::function<void()> wake) : wake_(std::move(wake)) {}

  void Wake() override {
    std::lock_guard<std::mutex> lock(mutex_);
    if (wake_) wake_();
  }

  // `wake` is not called any more once it has returned.
  void Detach() {
    std::lock_guard<std::mutex> lock(mutex_);
    wake_ = nullptr;
  }

 private:
  std::mutex mutex_;
  std::function<void()> wake_;
};

}  // namespace amhex::server
