// One WatchJob stream: at most one write at a time, always the next frame the reader should see.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <mutex>

#include "amhex/v1/meshing_service.pb.h"
#include "blocking_executor.h"
#include "call_record.h"
#include "feed_waker.h"
#include "job_manager.h"

namespace amhex::server {

// Owns itself: gRPC calls OnDone exactly once, which deletes it.
class WatchReactor final : public grpc::ServerWriteReactor<amhex::v1::WatchJobResponse> {
 public:
  WatchReactor(absl::StatusOr<Caller> caller, const amhex::v1::WatchJobRequest& request,
               JobManager* manager, BlockingExecutor* executor);

  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  void Open(const absl::StatusOr<Caller>& caller, const amhex::v1::WatchJobRequest& request);
  // Sends the next frame or the end, unless a write is under way.
  void Pump();
  void End(const absl::Status& status);

  JobManager* const manager_;
  const CallRecord record_;
  std::shared_ptr<FeedWaker> waker_;
  std::mutex mutex_;
  std::unique_ptr<FeedReader> reader_;
  amhex::v1::WatchJobResponse frame_;  // being written
  bool writing_ = false;
  bool cancelled_ = false;
  bool finished_ = false;
};

}  // namespace amhex::server
