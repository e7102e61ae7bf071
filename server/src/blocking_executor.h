// Threads for work that blocks (disk, database), so that gRPC's own threads never do.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace amhex::server {

// Thread-safe. Tasks run in the order of posting, several at a time. The destructor runs what was
// posted and joins.
class BlockingExecutor {
 public:
  explicit BlockingExecutor(int thread_count);
  ~BlockingExecutor();

  void Post(std::function<void()> task);

 private:
  void Loop();

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> tasks_;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

// Tasks that run on an executor's threads one after the other, in the order of posting.
// Thread-safe. May end before its tasks have; the executor must not.
class Strand {
 public:
  explicit Strand(BlockingExecutor* executor) : state_(std::make_shared<State>()) {
    state_->executor = executor;
  }

  void Post(std::function<void()> task);

 private:
  struct State {
    BlockingExecutor* executor = nullptr;
    std::mutex mutex;
    std::deque<std::function<void()>> tasks;
    bool running = false;
  };
  static void RunNext(const std::shared_ptr<State>& state);

  const std::shared_ptr<State> state_;
};

}  // namespace amhex::server
