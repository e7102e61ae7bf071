// Meshing in one call, taken up by ordinary calls where its stream breaks.
#include <algorithm>

#include "rpc/client_implementation.h"
#include "rpc/digest.h"
#include "rpc/silence_guard.h"

namespace amhex::client {
namespace {

using Stream = grpc::ClientReaderWriter<v1::MeshRequest, v1::MeshResponse>;

// One input's way, over all streams and calls.
struct Course {
  std::string_view input;
  int64_t chunk_bytes = 0;
  const SubmitOptions* submit = nullptr;
  const WatchOptions* watch = nullptr;
  Patience patience;
  // How far it has come.
  int64_t committed = 0;  // of the input, by the server's word
  int64_t seq = 0;
  v1::Job job;  // without a name before it is submitted
  std::string mesh;
};

// However long a stream took: what counts is whether it moved anything.
void NoteCommitted(int64_t committed, Course* course) {
  if (committed <= course->committed) return;
  course->committed = committed;
  course->patience.Renew();
}

// False when the server takes no more.
bool SendInput(int64_t offset, Stream* stream, SilenceGuard* silence, Course* course) {
  const auto size = static_cast<int64_t>(course->input.size());
  while (offset < size) {
    v1::MeshRequest request;
    const int64_t length = std::min(course->chunk_bytes, size - offset);
    request.set_offset(offset);
    request.set_data(course->input.data() + offset, static_cast<size_t>(length));
    if (!stream->Write(request)) return false;
    silence->Renew();
    offset += length;
    if (course->submit->on_upload) course->submit->on_upload(offset, size);
  }
  return true;
}

// Takes chunks in order only.
bool TakeChunk(const v1::ReadBlobResponse& chunk, Course* course) {
  const int64_t whole = course->job.result().mesh().size_bytes();
  const auto have = static_cast<int64_t>(course->mesh.size());
  const auto more = static_cast<int64_t>(chunk.data().size());
  if (chunk.offset() != have || more > whole - have) return false;
  course->mesh.append(chunk.data());
  return true;
}

// Follows the server's messages to the stream's end, whose status tells why; false where they make
// no sense.
bool Follow(Stream* stream, SilenceGuard* silence, Course* course) {
  v1::MeshResponse response;
  while (stream->Read(&response)) {
    silence->Renew();
    if (response.has_upload()) {
      NoteCommitted(response.upload().committed_size(), course);
    } else {
      course->patience.Renew();
    }
    if (response.has_upload() && !response.upload().complete() &&
        !SendInput(response.upload().committed_size(), stream, silence, course)) {
      return true;
    }
    if (response.has_watch()) {
      course->seq = response.watch().seq();
      if (response.watch().has_job()) course->job = response.watch().job();
      if (course->watch->on_frame) course->watch->on_frame(response.watch());
    }
    if (response.has_mesh() && !TakeChunk(response.mesh(), course)) return false;
  }
  return true;
}

}  // namespace

absl::StatusOr<MeshedInput> Client::Mesh(const EncodedInput& input, const v1::MeshingParams& params,
                                         const SubmitOptions& submit, const WatchOptions& watch) {
  const absl::StatusOr<v1::Limits> limits = implementation_->GetLimits();
  if (!limits.ok()) return limits.status();
  v1::MeshRequest first;
  *first.mutable_submit() = implementation_->NewRequest(input, params, submit);
  if (Implementation::IsInline(input, *limits)) {
    first.mutable_submit()->set_inline_input(input.bytes);
  } else {
    v1::BlobRef& blob = *first.mutable_submit()->mutable_input_blob();
    blob.set_sha256(Sha256Hex(input.bytes));
    blob.set_size_bytes(static_cast<int64_t>(input.bytes.size()));
  }
  constexpr int64_t kDefaultChunkBytes = int64_t{1024} * 1024;
  const int64_t chunk_bytes =
      limits->preferred_chunk_bytes() > 0 ? limits->preferred_chunk_bytes() : kDefaultChunkBytes;
  Course course{input.bytes, chunk_bytes, &submit, &watch, implementation_->NewPatience(),
                0,           0,           {},      {}};
  while (course.job.name().empty()) {
    InterruptibleCall call(implementation_->options);
    const auto stream = implementation_->mesher->Mesh(call.context());
    SilenceGuard silence(call.context(),
                         kTransferSilenceFactor * implementation_->options.longest_silence);
    stream->Write(first);
    if (!Follow(stream.get(), &silence, &course)) call.context()->TryCancel();
    absl::Status status = silence.Verdict(FromGrpcStatus(stream->Finish()));
    if (!course.job.name().empty()) break;
    if (status.ok()) status = absl::UnavailableError("the stream ended before the job");
    if (!course.patience.MayPass(status)) return implementation_->Named(status);
    if (watch.on_reconnect) watch.on_reconnect(status);
    if (first.submit().has_input_blob()) {
      const auto there = implementation_->QueryWriteStatus(first.submit().input_blob());
      if (!there.ok()) return there.status();
      NoteCommitted(there->committed_size(), &course);
    }
    if (!course.patience.ShouldRetry(status)) return implementation_->Named(status);
  }
  if (!IsFinal(course.job)) {
    const absl::Status status =
        implementation_->WatchOn(course.job.name(), watch, &course.seq, &course.job);
    if (!status.ok()) return status;
  }
  MeshedInput meshed;
  meshed.job = course.job;
  if (course.job.state() != v1::Job::SUCCEEDED) return meshed;
  const v1::BlobRef& blob = course.job.result().mesh();
  const absl::Status whole = implementation_->ReadRest(blob, {}, &course.mesh);
  if (!whole.ok()) return whole;
  absl::StatusOr<AtMostHexaMesh> mesh =
      Implementation::CheckedMesh(course.job.result(), course.mesh);
  if (!mesh.ok()) return mesh.status();
  meshed.mesh = *std::move(mesh);
  return meshed;
}

}  // namespace amhex::client
