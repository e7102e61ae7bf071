#include "blob_transfer.h"

#include <algorithm>

#include "errors.h"
#include "request_checks.h"
#include "status_macros.h"

namespace amhex::server {

absl::StatusOr<JobManager::UploadState> BlobReceiver::Begin(const Caller& caller,
                                                            const amhex::v1::BlobRef& blob) {
  AMHEX_RETURN_IF_ERROR(CheckBlobToWrite(blob, manager_->options().limits));
  blob_ = blob;
  AMHEX_ASSIGN_OR_RETURN(const auto state, manager_->FindUpload(caller, blob));
  if (state.complete) return state;
  AMHEX_ASSIGN_OR_RETURN(upload_, manager_->StartUpload(caller, blob));
  return JobManager::UploadState{upload_->committed_size(), false};
}

absl::Status BlobReceiver::Store(int64_t offset, const BytePieces& pieces) {
  size_t size = 0;
  for (const std::string_view piece : pieces) size += piece.size();
  if (size == 0) return absl::OkStatus();
  absl::Status stored = upload_->Store(offset, pieces);
  const bool is_full = ReasonOf(stored) == "STORAGE_FULL";
  if (is_full && manager_->MakeRoomForInput(static_cast<int64_t>(size))) {
    stored = upload_->Store(offset, pieces);
  }
  AMHEX_RETURN_IF_ERROR(stored);
  manager_->metrics().BlobBytes("in").Increment(static_cast<double>(size));
  return absl::OkStatus();
}

absl::Status BlobReceiver::Digest(const BytePieces& pieces) { return upload_->Digest(pieces); }

absl::Status BlobReceiver::Write(int64_t offset, const std::string& data) {
  AMHEX_RETURN_IF_ERROR(Store(offset, {data}));
  return Digest({data});
}

absl::Status BlobReceiver::Finish(const Caller& caller) {
  return manager_->FinishUpload(caller, blob_, upload_.get());
}

JobManager::UploadState BlobReceiver::End() {
  const JobManager::UploadState state{upload_->committed_size(), upload_->complete()};
  upload_.reset();
  return state;
}

absl::Status BlobSender::Open(const Caller& caller, const amhex::v1::ReadBlobRequest& request) {
  AMHEX_RETURN_IF_ERROR(CheckRead(request));
  AMHEX_ASSIGN_OR_RETURN(file_, manager_->OpenBlob(caller, request.blob().sha256()));
  AMHEX_ASSIGN_OR_RETURN(blob_size_, FileSize(file_.get()));
  FieldViolations bad;
  CheckSaidSize("blob.size_bytes", request.blob(), blob_size_, &bad);
  AMHEX_RETURN_IF_ERROR(bad.ToStatus());
  AMHEX_ASSIGN_OR_RETURN(const ByteRange range, RangeToRead(request, blob_size_));
  position_ = range.begin;
  end_ = range.end;
  const int64_t preferred = manager_->options().limits.preferred_chunk_bytes;
  chunk_bytes_ =
      request.chunk_bytes() > 0 ? std::min<int64_t>(request.chunk_bytes(), preferred) : preferred;
  return absl::OkStatus();
}

size_t BlobSender::Describe(amhex::v1::ReadBlobResponse* chunk) {
  chunk->set_offset(position_);
  chunk->set_blob_size_bytes(is_first_ ? blob_size_ : 0);
  is_first_ = false;
  return static_cast<size_t>(std::min(chunk_bytes_, end_ - position_));
}

absl::Status BlobSender::Next(amhex::v1::ReadBlobResponse* chunk) {
  const size_t size = Describe(chunk);
  chunk->mutable_data()->resize(size);
  return ReadBytes(chunk->mutable_data()->data(), size);
}

absl::StatusOr<grpc::ByteBuffer> BlobSender::NextFrame() {
  amhex::v1::ReadBlobResponse fields;
  const size_t size = Describe(&fields);
  const grpc::Slice room = MakeRoom(size);
  // Nobody else sees the slice yet.
  AMHEX_RETURN_IF_ERROR(ReadBytes(const_cast<uint8_t*>(room.begin()), size));
  return FrameChunk(fields, room);
}

absl::Status BlobSender::ReadBytes(void* data, size_t size) {
  AMHEX_ASSIGN_OR_RETURN(const size_t got, ReadAt(file_.get(), data, size, position_));
  if (got != size) {
    return MakeError(absl::StatusCode::kDataLoss, amhex::v1::BLOB_CORRUPT,
                     "the stored blob is shorter than it was");
  }
  position_ += static_cast<int64_t>(size);
  manager_->metrics().BlobBytes("out").Increment(static_cast<double>(size));
  return absl::OkStatus();
}

}  // namespace amhex::server
