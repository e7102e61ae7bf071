#include "blob_reactors.h"

#include <utility>

#include "grpc_status.h"
#include "request_checks.h"
#include "status_macros.h"

namespace amhex::server {

WriteBlobReactor::WriteBlobReactor(absl::StatusOr<Caller> caller,
                                   amhex::v1::WriteBlobResponse* response, JobManager* manager,
                                   BlockingExecutor* executor)
    : caller_(std::move(caller)), response_(response), executor_(executor), receiver_(manager) {
  if (caller_.ok()) {
    StartRead(&chunk_);
  } else {
    Finish(ToGrpc(caller_.status()));
  }
}

void WriteBlobReactor::OnReadDone(bool ok) {
  if (!ok) {  // the client has sent all it wants to, or is gone
    Answer(receiver_.begun() ? absl::OkStatus() : CheckBlobRef(chunk_.blob()));
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

absl::StatusOr<bool> WriteBlobReactor::Take() {
  if (!receiver_.begun()) {
    AMHEX_ASSIGN_OR_RETURN(const auto state, receiver_.Begin(*caller_, chunk_.blob()));
    response_->set_committed_size(state.committed_size);
    response_->set_complete(state.complete);
    if (state.complete) return false;
  }
  AMHEX_RETURN_IF_ERROR(receiver_.Write(chunk_.offset(), chunk_.data()));
  if (!chunk_.finish()) return true;
  AMHEX_RETURN_IF_ERROR(receiver_.Finish(*caller_));
  return false;
}

void WriteBlobReactor::Answer(const absl::Status& status) {
  if (receiver_.begun()) {
    const auto state = receiver_.End();
    response_->set_committed_size(state.committed_size);
    response_->set_complete(state.complete);
  }
  Finish(ToGrpc(status));
}

ReadBlobReactor::ReadBlobReactor(absl::StatusOr<Caller> caller,
                                 const amhex::v1::ReadBlobRequest& request, JobManager* manager,
                                 BlockingExecutor* executor)
    : sender_(manager), executor_(executor) {
  executor_->Post([this, caller = std::move(caller), request] {
    const absl::Status status = caller.ok() ? sender_.Open(*caller, request) : caller.status();
    if (status.ok()) {
      SendNext();
    } else {
      Finish(ToGrpc(status));
    }
  });
}

void ReadBlobReactor::SendNext() {
  if (sender_.done()) {
    Finish(grpc::Status::OK);
    return;
  }
  const absl::Status status = sender_.Next(&response_);
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
