// The streams of amhex.v1.Blobs. Each owns itself: gRPC calls OnDone exactly once.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>

#include "amhex/v1/blob_service.pb.h"
#include "blocking_executor.h"
#include "job_manager.h"

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
  // True if the blob is there already.
  absl::StatusOr<bool> Start();
  void Answer(const absl::Status& status);

  const absl::StatusOr<Caller> caller_;
  amhex::v1::WriteBlobResponse* const response_;
  JobManager* const manager_;
  BlockingExecutor* const executor_;
  amhex::v1::WriteBlobRequest chunk_;
  amhex::v1::BlobRef blob_;
  std::unique_ptr<BlobUpload> upload_;
};

// Reads a chunk from disk on the executor, writes it, reads the next.
class ReadBlobReactor final : public grpc::ServerWriteReactor<amhex::v1::ReadBlobResponse> {
 public:
  ReadBlobReactor(absl::StatusOr<Caller> caller, const amhex::v1::ReadBlobRequest& request,
                  JobManager* manager, BlockingExecutor* executor);
  void OnWriteDone(bool ok) override;
  void OnDone() override { delete this; }

 private:
  absl::Status Open(const absl::StatusOr<Caller>& caller,
                    const amhex::v1::ReadBlobRequest& request);
  absl::Status ReadChunk();
  void SendNext();

  JobManager* const manager_;
  BlockingExecutor* const executor_;
  UniqueFd file_;
  int64_t position_ = 0;
  int64_t end_ = 0;
  int64_t chunk_bytes_ = 0;
  bool is_first_ = true;
  int64_t blob_size_ = 0;
  amhex::v1::ReadBlobResponse response_;
};

}  // namespace amhex::server
