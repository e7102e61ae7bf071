// The streams of amhex.v1.Blobs. Each owns itself: gRPC calls OnDone exactly once.
#pragma once

#include <grpcpp/grpcpp.h>

#include "amhex/v1/blob_service.pb.h"
#include "blob_transfer.h"
#include "blocking_executor.h"

namespace amhex::server {

// Reads a chunk, writes it to disk on the executor, reads the next.
class WriteBlobReactor final : public grpc::ServerReadReactor<amhex::v1::WriteBlobRequest> {
 public:
  WriteBlobReactor(absl::StatusOr<Caller> caller, amhex::v1::WriteBlobResponse* response,
                   JobManager* manager, BlockingExecutor* executor);
  void OnReadDone(bool ok) override;
  void OnDone() override { delete this; }

 private:
  // True while more chunks are wanted.
  absl::StatusOr<bool> Take();
  void Answer(const absl::Status& status);

  const absl::StatusOr<Caller> caller_;
  amhex::v1::WriteBlobResponse* const response_;
  BlockingExecutor* const executor_;
  BlobReceiver receiver_;
  amhex::v1::WriteBlobRequest chunk_;
};

// Reads a chunk from disk on the executor, writes it, reads the next.
class ReadBlobReactor final : public grpc::ServerWriteReactor<amhex::v1::ReadBlobResponse> {
 public:
  ReadBlobReactor(absl::StatusOr<Caller> caller, const amhex::v1::ReadBlobRequest& request,
                  JobManager* manager, BlockingExecutor* executor);
  void OnWriteDone(bool ok) override;
  void OnDone() override { delete this; }

 private:
  void SendNext();

  BlobSender sender_;
  BlockingExecutor* const executor_;
  amhex::v1::ReadBlobResponse response_;
};

}  // namespace amhex::server
