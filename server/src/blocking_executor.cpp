#include "blocking_executor.h"

#include <utility>

namespace amhex::server {

BlockingExecutor::BlockingExecutor(int thread_count) {
  for (int i = 0; i < thread_count; ++i) threads_.emplace_back([this] { Loop(); });
}

BlockingExecutor::~BlockingExecutor() {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void BlockingExecutor::Post(std::function<void()> task) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    tasks_.push_back(std::move(task));
  }
  wake_.notify_one();
}

void BlockingExecutor::Loop() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return stopping_ || !tasks_.empty(); });
    if (tasks_.empty()) return;
    const std::function<void()> task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    task();
    lock.lock();
  }
}

void Strand::Post(std::function<void()> task) {
  {
    std::lock_guard<std::mutex> lock(state_->mutex);
    state_->tasks.push_back(std::move(task));
    if (state_->running) return;
    state_->running = true;
  }
  state_->executor->Post([state = state_] { RunNext(state); });
}

// One task, then back into the executor's queue, so that others get their turn.
void Strand::RunNext(const std::shared_ptr<State>& state) {
  std::function<void()> task;
  {
    std::lock_guard<std::mutex> lock(state->mutex);
    task = std::move(state->tasks.front());
    state->tasks.pop_front();
  }
  task();
  {
    std::lock_guard<std::mutex> lock(state->mutex);
    state->running = !state->tasks.empty();
    if (!state->running) return;
  }
  state->executor->Post([state] { RunNext(state); });
}

}  // namespace amhex::server
