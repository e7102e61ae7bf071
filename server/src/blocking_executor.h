// Threads for work that blocks (disk, database), so that gRPC's own threads never do.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
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

}  // namespace amhex::server
