#include "watch_reactor.h"

#include <utility>

#include "monotonic_clock.h"
#include "request_checks.h"

namespace amhex::server {

WatchReactor::WatchReactor(absl::StatusOr<Caller> caller, const amhex::v1::WatchJobRequest& request,
                           JobManager* manager, BlockingExecutor* executor)
    : manager_(manager),
      record_(&manager->metrics(), "amhex.v1.Mesher/WatchJob"),
      waker_(std::make_shared<FeedWaker>([this] { Pump(); })) {
  // gRPC keeps the call open until Finish, so the reactor outlives this task.
  executor->Post([this, caller = std::move(caller), request] { Open(caller, request); });
}

void WatchReactor::Open(const absl::StatusOr<Caller>& caller,
                        const amhex::v1::WatchJobRequest& request) {
  // From the moment there is a reader, a caller who leaves may end this object under our feet; the
  // waker knows.
  const std::shared_ptr<FeedWaker> waker = waker_;
  absl::Status status = caller.ok() ? CheckWatch(request) : caller.status();
  if (status.ok()) {
    auto reader = manager_->Watch(*caller, request, waker_);
    status = reader.status();
    if (status.ok()) {
      std::lock_guard<std::mutex> lock(mutex_);
      reader_ = *std::move(reader);
    }
  }
  if (status.ok()) {
    waker->Wake();
  } else {
    End(status);
  }
}

void WatchReactor::Pump() {
  FeedReader::Item item;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (!reader_ || writing_ || finished_) return;
    if (cancelled_) {
      item.end = absl::CancelledError("the client ended the stream");
    } else {
      item = reader_->Next(MonotonicNow());
    }
    if (item.frame) {
      frame_ = *std::move(item.frame);
      writing_ = true;
    }
  }
  if (item.frame) {
    manager_->metrics().ProgressFrames("sent").Increment();
    StartWrite(&frame_);
  } else if (item.end) {
    End(*item.end);
  }
}

void WatchReactor::End(const absl::Status& status) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (finished_) return;
    finished_ = true;
  }
  Finish(record_.End(status));
}

void WatchReactor::OnWriteDone(bool ok) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    writing_ = false;
    cancelled_ = cancelled_ || !ok;
  }
  Pump();
}

void WatchReactor::OnCancel() {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    cancelled_ = true;
  }
  Pump();
}

void WatchReactor::OnDone() {
  waker_->Detach();
  if (reader_) {
    manager_->metrics()
        .ProgressFrames("conflated")
        .Increment(static_cast<double>(reader_->conflated_count()));
  }
  delete this;
}

}  // namespace amhex::server
