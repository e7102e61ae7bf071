#include "blob_reactors.h"

#include <algorithm>
#include <utility>

#include "errors.h"
#include "grpc_status.h"
#include "request_checks.h"
#include "status_macros.h"

namespace amhex::server {

WriteBlobReactor::WriteBlobReactor(absl::StatusOr<Caller> caller,
                                   amhex::v1::WriteBlobResponse* response, JobManager* manager,
                                   BlockingExecutor* executor)
    : caller_(std::move(caller)), response_(response), manager_(manager), executor_(executor) {
  if (caller_.ok()) {
    StartRead(&chunk_);
  } else {
    Finish(ToGrpc(caller_.status()));
  }
}

void WriteBlobReactor::OnReadDone(bool ok) {
  if (!ok) {  // the client has sent all it wants to, or is gone
    Answer(upload_ ? absl::OkStatus() : CheckBlobRef(chunk_.blob()));
    return;
  }
  executor_->Post([this] {
    const auto more = Take();
    if (more.ok() && *more) {
      StartRead(&chunk_);
    } else {
      Answer(more.status());
    }
  });
}

absl::StatusOr<bool> WriteBlobReactor::Start() {
  blob_ = chunk_.blob();
  AMHEX_RETURN_IF_ERROR(CheckBlobToWrite(blob_, manager_->options().limits));
  AMHEX_ASSIGN_OR_RETURN(const auto state, manager_->FindUpload(*caller_, blob_));
  response_->set_committed_size(state.committed_size);
  response_->set_complete(state.complete);
  if (state.complete) return true;
  AMHEX_ASSIGN_OR_RETURN(upload_, manager_->StartUpload(*caller_, blob_));
  return false;
}

absl::StatusOr<bool> WriteBlobReactor::Take() {
  if (!upload_) {
    AMHEX_ASSIGN_OR_RETURN(const bool complete, Start());
    if (complete) return false;
  }
  if (!chunk_.data().empty()) {
    AMHEX_RETURN_IF_ERROR(
        upload_->Write(chunk_.offset(), chunk_.data().data(), chunk_.data().size()));
    manager_->metrics().BlobBytes("in").Increment(static_cast<double>(chunk_.data().size()));
  }
  if (chunk_.finish()) {
    AMHEX_RETURN_IF_ERROR(manager_->FinishUpload(*caller_, blob_, upload_.get()));
    return false;
  }
  return true;
}

void WriteBlobReactor::Answer(const absl::Status& status) {
  if (upload_) {
    response_->set_committed_size(upload_->committed_size());
    response_->set_complete(upload_->complete());
    upload_.reset();
  }
  Finish(ToGrpc(status));
}

ReadBlobReactor::ReadBlobReactor(absl::StatusOr<Caller> caller,
                                 const amhex::v1::ReadBlobRequest& request, JobManager* manager,
                                 BlockingExecutor* executor)
    : manager_(manager), executor_(executor) {
  executor_->Post([this, caller = std::move(caller), request] {
    const absl::Status status = Open(caller, request);
    if (status.ok()) {
      SendNext();
    } else {
      Finish(ToGrpc(status));
    }
  });
}

absl::Status ReadBlobReactor::Open(const absl::StatusOr<Caller>& caller,
                                   const amhex::v1::ReadBlobRequest& request) {
  AMHEX_RETURN_IF_ERROR(caller.status());
  AMHEX_RETURN_IF_ERROR(CheckRead(request));
  AMHEX_ASSIGN_OR_RETURN(file_, manager_->OpenBlob(*caller, request.blob().sha256()));
  AMHEX_ASSIGN_OR_RETURN(blob_size_, FileSize(file_.get()));
  if (request.offset() > blob_size_) {
    return MakeError(absl::StatusCode::kOutOfRange, amhex::v1::BAD_REQUEST,
                     "offset is " + std::to_string(request.offset()) + ", but the blob has " +
                         std::to_string(blob_size_) + " bytes");
  }
  position_ = request.offset();
  end_ = blob_size_;
  if (request.limit() > 0) end_ = position_ + std::min(request.limit(), blob_size_ - position_);
  const int64_t preferred = manager_->options().limits.preferred_chunk_bytes;
  chunk_bytes_ =
      request.chunk_bytes() > 0 ? std::min<int64_t>(request.chunk_bytes(), preferred) : preferred;
  return absl::OkStatus();
}

absl::Status ReadBlobReactor::ReadChunk() {
  const auto size = static_cast<size_t>(std::min(chunk_bytes_, end_ - position_));
  response_.set_offset(position_);
  response_.set_blob_size_bytes(is_first_ ? blob_size_ : 0);
  is_first_ = false;
  response_.mutable_data()->resize(size);
  AMHEX_ASSIGN_OR_RETURN(const size_t got,
                         ReadAt(file_.get(), response_.mutable_data()->data(), size, position_));
  if (got != size) {
    return MakeError(absl::StatusCode::kDataLoss, amhex::v1::BLOB_CORRUPT,
                     "the stored blob is shorter than it was");
  }
  position_ += static_cast<int64_t>(size);
  manager_->metrics().BlobBytes("out").Increment(static_cast<double>(size));
  return absl::OkStatus();
}

void ReadBlobReactor::SendNext() {
  // An empty blob still gets one message, which tells its size.
  if (position_ >= end_ && !is_first_) {
    Finish(grpc::Status::OK);
    return;
  }
  const absl::Status status = ReadChunk();
  if (status.ok()) {
    StartWrite(&response_);
  } else {
    Finish(ToGrpc(status));
  }
}

void ReadBlobReactor::OnWriteDone(bool ok) {
  if (!ok) {
    Finish(ToGrpc(absl::CancelledError("the client ended the stream")));
    return;
  }
  executor_->Post([this] { SendNext(); });
}

}  // namespace amhex::server
