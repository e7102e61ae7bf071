#include "mesh_reactor.h"

#include <utility>

#include "errors.h"
#include "job.h"
#include "job_id.h"
#include "monotonic_clock.h"
#include "request_checks.h"
#include "status_macros.h"

namespace amhex::server {

using amhex::v1::Job;

MeshReactor::MeshReactor(absl::StatusOr<Caller> caller, Parts parts)
    : caller_(std::move(caller)),
      parts_(std::move(parts)),
      record_(&parts_.manager->metrics(), "amhex.v1.Mesher/Mesh"),
      waker_(std::make_shared<FeedWaker>([this] { Pump(); })),
      receiver_(parts_.manager),
      sender_(parts_.manager) {
  if (caller_.ok()) {
    StartRead(&request_);
  } else {
    End(caller_.status());
  }
}

void MeshReactor::OnReadDone(bool ok) {
  if (ok) {
    parts_.executor->Post([this] { Take(); });
    return;
  }
  // The caller has sent all it wants to, or is gone.
  End(begun_ ? WithPrecondition(
                   MakeError(absl::StatusCode::kFailedPrecondition, amhex::v1::BLOB_MISSING,
                             "the stream ended before the input was complete; " +
                                 std::to_string(receiver_.committed_size()) + " bytes are stored"),
                   "MISSING", "blobs/" + submit_.input_blob().sha256())
             : CheckMeshBegin(request_, parts_.manager->options().limits));
}

void MeshReactor::Take() {
  const absl::Status status = begun_ ? TakeMore() : TakeFirst();
  if (!status.ok()) End(status);
}

absl::Status MeshReactor::TakeFirst() {
  AMHEX_RETURN_IF_ERROR(CheckMeshBegin(request_, parts_.manager->options().limits));
  submit_ = std::move(*request_.mutable_submit());
  cancel_with_stream_ = request_.cancel_with_stream();
  begun_ = true;
  if (submit_.has_inline_input()) {
    Submit();
    return absl::OkStatus();
  }
  AMHEX_ASSIGN_OR_RETURN(const auto state, receiver_.Begin(*caller_, submit_.input_blob()));
  response_.mutable_upload()->set_committed_size(state.committed_size);
  response_.mutable_upload()->set_complete(state.complete);
  input_complete_ = state.complete;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    writing_ = true;
  }
  StartWrite(&response_);
  return absl::OkStatus();
}

absl::Status MeshReactor::TakeMore() {
  if (request_.has_submit()) {
    FieldViolations bad;
    bad.Add("submit", "may only come in the first message");
    return bad.ToStatus();
  }
  AMHEX_RETURN_IF_ERROR(receiver_.Write(request_.offset(), request_.data()));
  if (receiver_.committed_size() < submit_.input_blob().size_bytes()) {
    StartRead(&request_);
    return absl::OkStatus();
  }
  AMHEX_RETURN_IF_ERROR(receiver_.Finish(*caller_));
  receiver_.End();
  Submit();
  return absl::OkStatus();
}

void MeshReactor::Submit() {
  bool is_wanted = false;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (finished_) return;
    is_wanted = !cancelled_;
    if (is_wanted) phase_ = Phase::kWatch;
  }
  // Nobody would hear of a job that is submitted now; the caller repeats the call.
  if (!is_wanted) return End(absl::CancelledError("the client ended the stream"));
  const auto job = parts_.submit(*caller_, submit_);
  if (!job.ok()) return End(job.status());
  {
    std::lock_guard<std::mutex> lock(mutex_);
    job_ = *job;
  }
  amhex::v1::WatchJobRequest watch;
  watch.set_name(job->name());
  auto reader = parts_.manager->Watch(*caller_, watch, waker_);
  if (!reader.ok()) return End(reader.status());
  // From the moment there is a reader, a caller who leaves may end this object under our feet; the
  // waker knows.
  const std::shared_ptr<FeedWaker> waker = waker_;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    reader_ = *std::move(reader);
  }
  waker->Wake();
}

void MeshReactor::Pump() {
  FeedReader::Item item;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (!reader_ || phase_ != Phase::kWatch || writing_ || finished_) return;
    if (cancelled_) {
      item.end = absl::CancelledError("the client ended the stream");
    } else {
      item = reader_->Next(MonotonicNow());
    }
    if (item.frame) {
      if (item.frame->has_job()) job_ = item.frame->job();
      *response_.mutable_watch() = *std::move(item.frame);
      writing_ = true;
    }
    if (item.end && item.end->ok() && job_.state() == Job::SUCCEEDED) phase_ = Phase::kDownload;
  }
  if (item.frame) {
    parts_.manager->metrics().ProgressFrames("sent").Increment();
    StartWrite(&response_);
  } else if (item.end) {
    const bool goes_on = item.end->ok() && job_.state() == Job::SUCCEEDED;
    goes_on ? StartDownload() : End(*item.end);
  }
}

void MeshReactor::StartDownload() {
  parts_.executor->Post([this] {
    amhex::v1::ReadBlobRequest read;
    *read.mutable_blob() = job_.result().mesh();
    const absl::Status status = sender_.Open(*caller_, read);
    status.ok() ? SendChunk() : End(status);
  });
}

void MeshReactor::SendChunk() {
  if (sender_.done()) return End(absl::OkStatus());
  const absl::Status status = sender_.Next(response_.mutable_mesh());
  if (!status.ok()) return End(status);
  StartWrite(&response_);
}

void MeshReactor::OnWriteDone(bool ok) {
  Phase phase;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    writing_ = false;
    cancelled_ = cancelled_ || !ok;
    phase = phase_;
  }
  if (phase == Phase::kWatch) {
    Pump();
  } else if (!ok) {
    End(absl::CancelledError("the client ended the stream"));
  } else if (phase == Phase::kDownload) {
    parts_.executor->Post([this] { SendChunk(); });
  } else if (input_complete_) {
    parts_.executor->Post([this] { Submit(); });
  } else {
    StartRead(&request_);
  }
}

void MeshReactor::OnCancel() {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    cancelled_ = true;
  }
  Pump();
}

void MeshReactor::End(const absl::Status& status) {
  std::string abandoned;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (finished_) return;
    finished_ = true;
    // A server that shuts down cuts its streams; that is not the caller's wish.
    if (cancelled_ && cancel_with_stream_ && !parts_.manager->draining() && !job_.name().empty() &&
        !IsFinal(job_.state())) {
      abandoned = JobIdFromName(job_.name());
    }
  }
  if (!abandoned.empty()) {
    parts_.executor->Post([manager = parts_.manager, caller = *caller_, abandoned] {
      manager->Cancel(caller, abandoned).IgnoreError();
    });
  }
  Finish(record_.End(status));
}

void MeshReactor::OnDone() {
  waker_->Detach();
  if (reader_) {
    parts_.manager->metrics()
        .ProgressFrames("conflated")
        .Increment(static_cast<double>(reader_->conflated_count()));
  }
  delete this;
}

}  // namespace amhex::server
