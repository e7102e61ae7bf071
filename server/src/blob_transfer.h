// The two directions of a blob, as streams need them: bytes taken in order, bytes given in chunks.
#pragma once

#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "amhex/v1/blob_service.pb.h"
#include "blob_frames.h"
#include "caller.h"
#include "files.h"
#include "job_manager.h"

namespace amhex::server {

// Bytes of one blob that come from a caller. Thread-compatible, but for Digest, which may run
// beside Store; blocks for the disk.
class BlobReceiver {
 public:
  explicit BlobReceiver(JobManager* manager) : manager_(manager) {}

  // Where the caller goes on; `complete` if nothing is missing.
  absl::StatusOr<JobManager::UploadState> Begin(const Caller& caller,
                                                const amhex::v1::BlobRef& blob);
  bool begun() const { return upload_ != nullptr; }

  // As BlobUpload.
  absl::Status Store(int64_t offset, const BytePieces& pieces);
  absl::Status Digest(const BytePieces& pieces);
  absl::Status Write(int64_t offset, const std::string& data);
  // All bytes have come.
  absl::Status Finish(const Caller& caller);
  // What is stored now; lets go of the upload.
  JobManager::UploadState End();

  int64_t committed_size() const { return upload_ ? upload_->committed_size() : 0; }

 private:
  JobManager* const manager_;
  amhex::v1::BlobRef blob_;
  std::unique_ptr<BlobUpload> upload_;
};

// Bytes of one blob that go to a caller. Thread-compatible; blocks for the disk.
class BlobSender {
 public:
  explicit BlobSender(JobManager* manager) : manager_(manager) {}

  // INVALID_ARGUMENT, NOT_FOUND, OUT_OF_RANGE.
  absl::Status Open(const Caller& caller, const amhex::v1::ReadBlobRequest& request);
  // True once all has been given; an empty blob has one chunk, which tells its size.
  bool done() const { return position_ >= end_ && !is_first_; }
  // The next chunk. DATA_LOSS BLOB_CORRUPT.
  absl::Status Next(amhex::v1::ReadBlobResponse* chunk);
  // The same as it goes over the wire.
  absl::StatusOr<grpc::ByteBuffer> NextFrame();

 private:
  // All fields but the bytes; how many of those there are.
  size_t Describe(amhex::v1::ReadBlobResponse* chunk);
  absl::Status ReadBytes(void* data, size_t size);

  JobManager* const manager_;
  UniqueFd file_;
  int64_t position_ = 0;
  int64_t end_ = 0;
  int64_t chunk_bytes_ = 0;
  int64_t blob_size_ = 0;
  bool is_first_ = true;
};

}  // namespace amhex::server
