#include "blob_reactors.h"

#include <grpcpp/impl/codegen/proto_utils.h>

#include <utility>

#include "errors.h"
#include "request_checks.h"
#include "status_macros.h"

namespace amhex::server {
namespace {

// One that is received, one that is stored, one that is hashed, and one that waits.
constexpr int kMaxChunks = 4;
// Fewer of those that are larger than clients are told to send: what all uploads hold is bounded by
// their number.
constexpr size_t kMaxChunkBytes = kMaxChunks << 20;

absl::Status ClientGone() { return absl::CancelledError("the client ended the stream"); }

}  // namespace

WriteBlobReactor::WriteBlobReactor(absl::StatusOr<Caller> caller, grpc::ByteBuffer* response,
                                   JobManager* manager, BlockingExecutor* executor)
    : caller_(std::move(caller)),
      record_(&manager->metrics(), "amhex.v1.Blobs/WriteBlob"),
      response_(response),
      receiver_(manager),
      storing_(executor),
      hashing_(executor) {
  if (!caller_.ok()) outcome_ = caller_.status();
  Settle(std::unique_lock<std::mutex>(mutex_));
}

void WriteBlobReactor::OnReadDone(bool ok) {
  std::unique_lock<std::mutex> lock(mutex_);
  reading_ = false;
  if (!ok) ended_ = true;
  if (ok && !outcome_) {
    const auto chunk = std::make_shared<ReceivedChunk>();
    chunk->buffer.Swap(&incoming_);
    if (const absl::Status status = ParseChunk(chunk.get()); !status.ok()) {
      outcome_ = status;
    } else {
      ended_ = chunk->finish;
      ++chunk_count_;
      chunk_bytes_ += chunk->buffer.Length();
      storing_.Post([this, chunk] { Store(chunk); });
    }
  }
  Settle(std::move(lock));
}

void WriteBlobReactor::Store(const Chunk& chunk) {
  if (IsDecided()) return Leave(chunk, std::nullopt);
  absl::Status status;
  if (!receiver_.begun()) status = Begin(chunk->blob);
  // What is there already needs nothing of what comes.
  if (!status.ok() || state_.complete) return Leave(chunk, status);
  status = receiver_.Store(chunk->offset, chunk->data);
  if (!status.ok()) return Leave(chunk, status);
  hashing_.Post([this, chunk] { Digest(chunk); });
}

absl::Status WriteBlobReactor::Begin(const amhex::v1::BlobRef& blob) {
  AMHEX_ASSIGN_OR_RETURN(state_, receiver_.Begin(*caller_, blob));
  std::lock_guard<std::mutex> lock(mutex_);
  admitted_ = true;
  return absl::OkStatus();
}

void WriteBlobReactor::Digest(const Chunk& chunk) {
  absl::Status status = receiver_.Digest(chunk->data);
  if (status.ok() && !chunk->finish) return Leave(chunk, std::nullopt);
  if (status.ok()) status = receiver_.Finish(*caller_);
  Leave(chunk, status);
}

bool WriteBlobReactor::IsDecided() {
  std::lock_guard<std::mutex> lock(mutex_);
  return outcome_.has_value();
}

void WriteBlobReactor::Leave(const Chunk& chunk, const std::optional<absl::Status>& outcome) {
  std::unique_lock<std::mutex> lock(mutex_);
  --chunk_count_;
  chunk_bytes_ -= chunk->buffer.Length();
  if (!outcome_) outcome_ = outcome;
  Settle(std::move(lock));
}

bool WriteBlobReactor::MayTakeMore() const {
  if (!admitted_) return chunk_count_ == 0;
  return chunk_count_ < kMaxChunks && chunk_bytes_ < kMaxChunkBytes;
}

// Whoever changes the state decides under the same lock what follows: a moment later somebody else
// may have answered, and this object may be gone.
void WriteBlobReactor::Settle(std::unique_lock<std::mutex> lock) {
  while (!answered_ && !starting_read_) {
    if ((outcome_ || ended_) && chunk_count_ == 0) {
      answered_ = true;
      lock.unlock();
      return Answer();
    }
    if (outcome_ || ended_ || reading_ || !MayTakeMore()) return;
    reading_ = starting_read_ = true;
    lock.unlock();
    StartRead(&incoming_);
    lock.lock();
    starting_read_ = false;
  }
}

// Nobody else is left: there is no chunk and, but for one that nobody will look at, no read.
void WriteBlobReactor::Answer() {
  absl::Status status = outcome_.value_or(absl::OkStatus());
  if (receiver_.begun()) {
    state_ = receiver_.End();
  } else if (!outcome_) {
    status = CheckBlobRef(amhex::v1::BlobRef());  // the stream had no message
  }
  amhex::v1::WriteBlobResponse response;
  response.set_committed_size(state_.committed_size);
  response.set_complete(state_.complete);
  bool own_buffer = false;
  grpc::SerializationTraits<amhex::v1::WriteBlobResponse>::Serialize(response, response_,
                                                                     &own_buffer);
  Finish(record_.End(status));
}

ReadBlobReactor::ReadBlobReactor(absl::StatusOr<Caller> caller, const grpc::ByteBuffer& request,
                                 JobManager* manager, BlockingExecutor* executor)
    : record_(&manager->metrics(), "amhex.v1.Blobs/ReadBlob"),
      sender_(manager),
      executor_(executor) {
  executor_->Post([this, caller = std::move(caller), request] { Open(caller, request); });
}

void ReadBlobReactor::Open(const absl::StatusOr<Caller>& caller, grpc::ByteBuffer request) {
  amhex::v1::ReadBlobRequest read;
  absl::Status status = caller.status();
  if (status.ok() &&
      !grpc::SerializationTraits<amhex::v1::ReadBlobRequest>::Deserialize(&request, &read).ok()) {
    FieldViolations bad;
    bad.Add("message", "is no ReadBlobRequest");
    status = bad.ToStatus();
  }
  if (status.ok()) status = sender_.Open(*caller, read);
  if (status.ok()) return Prepare();
  Finish(record_.End(status));
}

void ReadBlobReactor::Prepare() {
  std::optional<absl::StatusOr<grpc::ByteBuffer>> frame;
  if (!sender_.done()) frame = sender_.NextFrame();
  std::unique_lock<std::mutex> lock(mutex_);
  preparing_ = false;
  if (frame && frame->ok()) {
    ready_ = **std::move(frame);
  } else if (!outcome_) {
    outcome_ = frame ? frame->status() : absl::OkStatus();
  }
  Settle(std::move(lock));
}

void ReadBlobReactor::OnWriteDone(bool ok) {
  std::unique_lock<std::mutex> lock(mutex_);
  writing_ = false;
  if (!ok) {
    ready_.reset();
    outcome_ = ClientGone();
  }
  Settle(std::move(lock));
}

// After the last of its lines nothing here may be touched: who is told then may end this object.
void ReadBlobReactor::Settle(std::unique_lock<std::mutex> lock) {
  if (outcome_ && !outcome_->ok()) ready_.reset();
  const bool is_sent = !writing_ && ready_;
  if (is_sent) {
    sending_ = *std::move(ready_);
    ready_.reset();
    writing_ = true;
  }
  const bool is_prepared = !ready_ && !preparing_ && !outcome_;
  if (is_prepared) {
    preparing_ = true;
    executor_->Post([this] { Prepare(); });
  }
  const bool is_over = outcome_ && !preparing_ && !writing_;
  const absl::Status status = outcome_.value_or(absl::OkStatus());
  lock.unlock();
  if (is_sent) StartWrite(&sending_);
  if (is_over) Finish(record_.End(status));
}

}  // namespace amhex::server
