// One Mesh stream: upload, submission, watching and download, one after the other, each only as
// fast as the caller takes or sends. Never more than one read or write is under way.
#pragma once

#include <grpcpp/grpcpp.h>

#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "amhex/v1/meshing_service.pb.h"
#include "blob_transfer.h"
#include "blocking_executor.h"
#include "call_record.h"
#include "feed_waker.h"
#include "job_manager.h"

namespace amhex::server {

// Owns itself: gRPC calls OnDone exactly once, which deletes it.
class MeshReactor final
    : public grpc::ServerBidiReactor<amhex::v1::MeshRequest, amhex::v1::MeshResponse> {
 public:
  struct Parts {
    JobManager* manager;
    BlockingExecutor* executor;
    // SubmitJob; blocks.
    std::function<absl::StatusOr<amhex::v1::Job>(const Caller&, const amhex::v1::SubmitJobRequest&)>
        submit;
  };
  MeshReactor(absl::StatusOr<Caller> caller, Parts parts);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  enum class Phase { kUpload, kWatch, kDownload };

  // On the executor.
  void Take();
  absl::Status TakeFirst();
  absl::Status TakeMore();
  void Submit();
  void SendChunk();

  // Sends the next frame, or goes on to what follows the last one.
  void Pump();
  void StartDownload();
  void End(const absl::Status& status);

  const absl::StatusOr<Caller> caller_;
  const Parts parts_;
  const CallRecord record_;
  const std::shared_ptr<FeedWaker> waker_;
  amhex::v1::MeshRequest request_;    // being read
  amhex::v1::MeshResponse response_;  // being written
  amhex::v1::SubmitJobRequest submit_;
  bool begun_ = false;
  bool cancel_with_stream_ = false;
  bool input_complete_ = false;
  BlobReceiver receiver_;
  BlobSender sender_;

  std::mutex mutex_;
  Phase phase_ = Phase::kUpload;
  std::unique_ptr<FeedReader> reader_;
  amhex::v1::Job job_;  // as last told; without a name before it is submitted
  bool writing_ = false;
  bool cancelled_ = false;
  bool finished_ = false;
};

}  // namespace amhex::server
