#include "worker_pool.h"

#include <set>
#include <utility>

#include "errors.h"
#include "monotonic_clock.h"
#include "status_macros.h"
#include "worker_slot.h"

namespace amhex::server {
namespace {

constexpr absl::Duration kEstimatePatience = absl::Seconds(60);
constexpr absl::Duration kEstimatePollInterval = absl::Milliseconds(250);

}  // namespace

WorkerPool::WorkerPool(const Options& options, JobManager* manager)
    : options_(options), manager_(manager) {}

WorkerPool::~WorkerPool() { Stop(absl::Now()); }

void WorkerPool::Start(std::function<void()> on_ready_change) {
  on_ready_change_ = std::move(on_ready_change);
  for (int i = 0; i < options_.worker_count; ++i) {
    slots_.push_back(std::make_unique<WorkerSlot>(this, i));
  }
  for (const auto& slot : slots_) slot->Start();
}

void WorkerPool::Stop(absl::Time deadline) {
  HurryUp(deadline);
  for (const auto& slot : slots_) slot->Join();
}

void WorkerPool::HurryUp(absl::Time deadline) {
  stopping_ = true;
  for (const auto& slot : slots_) slot->StartStopping(deadline);
}

void WorkerPool::ChangeReadyCount(int change) {
  ready_count_ += change;
  manager_->metrics().workers_ready.Increment(change);
  if (on_ready_change_) on_ready_change_();
}

void WorkerPool::ChangeQuarantinedCount(int change) {
  quarantined_count_ += change;
  manager_->metrics().workers_quarantined.Increment(change);
}

void WorkerPool::TakeHello(int worker, const amhex::worker::Hello& hello) {
  std::lock_guard<std::mutex> lock(mutex_);
  hello_ = hello;
  hellos_[worker] = hello;
}

amhex::worker::Hello WorkerPool::hello() const {
  std::lock_guard<std::mutex> lock(mutex_);
  amhex::worker::Hello all = hello_;
  all.clear_backends();
  std::set<std::string> told;
  for (const auto& entry : hellos_) {
    for (const auto& backend : entry.second.backends()) {
      if (told.insert(backend.SerializeAsString()).second) *all.add_backends() = backend;
    }
  }
  return all;
}

std::vector<pid_t> WorkerPool::pids() const {
  std::vector<pid_t> pids;
  for (const auto& slot : slots_) {
    if (slot->pid() != 0) pids.push_back(slot->pid());
  }
  return pids;
}

absl::StatusOr<amhex::v1::CostEstimate> WorkerPool::Estimate(amhex::worker::RunJob order) {
  const absl::Time deadline = MonotonicNow() + kEstimatePatience;
  AMHEX_ASSIGN_OR_RETURN(auto process,
                         WorkerProcess::Start(options_.command, options_.start_patience));
  order.set_estimate_only(true);
  amhex::worker::ToWorker frame;
  *frame.mutable_run() = std::move(order);
  AMHEX_RETURN_IF_ERROR(process->channel().Send(frame));
  amhex::worker::FromWorker news;
  while (true) {
    const auto outcome = process->channel().Receive(&news, kEstimatePollInterval);
    if (!outcome.ok()) {
      return MakeError(absl::StatusCode::kInvalidArgument, amhex::v1::INPUT_DECODE_LIMIT,
                       "the input killed the decoder");
    }
    if (stopping_) {
      return MakeError(absl::StatusCode::kUnavailable, amhex::v1::SERVER_DRAINING,
                       "the server is shutting down");
    }
    if (MonotonicNow() >= deadline) {
      return ServerFault("the estimate took longer than " +
                         absl::FormatDuration(kEstimatePatience));
    }
    if (*outcome != FrameChannel::Outcome::kFrame) continue;
    if (!news.has_finished()) continue;
    const absl::Status error = FromRpcStatus(news.finished().error());
    if (!error.ok()) return error;
    return news.finished().estimate();
  }
}

}  // namespace amhex::server
