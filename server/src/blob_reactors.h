// The streams of amhex.v1.Blobs. Each owns itself: gRPC calls OnDone exactly once.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <mutex>
#include <optional>

#include "blob_transfer.h"
#include "blocking_executor.h"
#include "call_record.h"

namespace amhex::server {

// Receives, stores and hashes at the same time, each chunk by chunk in order. A caller who sends
// faster than that is slowed down by gRPC's flow control: only so many chunks are taken at a time.
class WriteBlobReactor final : public grpc::ServerReadReactor<grpc::ByteBuffer> {
 public:
  WriteBlobReactor(absl::StatusOr<Caller> caller, grpc::ByteBuffer* response, JobManager* manager,
                   BlockingExecutor* executor);
  void OnReadDone(bool ok) override;
  void OnDone() override { delete this; }

 private:
  using Chunk = std::shared_ptr<ReceivedChunk>;

  // On the executor, each for one chunk at a time.
  void Store(const Chunk& chunk);
  void Digest(const Chunk& chunk);
  absl::Status Begin(const amhex::v1::BlobRef& blob);

  // Nothing more is to be done with one chunk; the stream ends with `outcome` if there is one.
  void Leave(const Chunk& chunk, const std::optional<absl::Status>& outcome);
  bool IsDecided();
  // Under the lock.
  bool MayTakeMore() const;
  // Reads on, or answers, whichever it is time for.
  void Settle(std::unique_lock<std::mutex> lock);
  void Answer();

  const absl::StatusOr<Caller> caller_;
  const CallRecord record_;
  grpc::ByteBuffer* const response_;
  BlobReceiver receiver_;
  JobManager::UploadState state_;
  Strand storing_;
  Strand hashing_;

  std::mutex mutex_;
  grpc::ByteBuffer incoming_;
  // Taken and not yet stored and hashed.
  int chunk_count_ = 0;
  size_t chunk_bytes_ = 0;
  bool admitted_ = false;  // among the uploads, which are counted
  bool reading_ = false;
  bool starting_read_ = false;
  bool ended_ = false;  // the caller sends no more
  bool answered_ = false;
  std::optional<absl::Status> outcome_;
};

// Reads the next chunk from disk while the last one is sent.
class ReadBlobReactor final : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  ReadBlobReactor(absl::StatusOr<Caller> caller, const grpc::ByteBuffer& request,
                  JobManager* manager, BlockingExecutor* executor);
  void OnWriteDone(bool ok) override;
  void OnDone() override { delete this; }

 private:
  void Open(const absl::StatusOr<Caller>& caller, grpc::ByteBuffer request);
  // On the executor: makes the next frame ready.
  void Prepare();
  // Sends what is ready once the last frame has gone, prepares the next, or ends.
  void Settle(std::unique_lock<std::mutex> lock);

  const CallRecord record_;
  BlobSender sender_;
  BlockingExecutor* const executor_;
  grpc::ByteBuffer sending_;

  std::mutex mutex_;
  std::optional<grpc::ByteBuffer> ready_;
  std::optional<absl::Status> outcome_;  // after what is ready
  bool preparing_ = true;
  bool writing_ = false;
};

}  // namespace amhex::server
