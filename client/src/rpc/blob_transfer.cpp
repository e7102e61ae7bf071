// Blobs: uploads and downloads that go on where they broke off.
#include <algorithm>

#include "cells/mesh_check.h"
#include "rpc/client_implementation.h"
#include "rpc/digest.h"
#include "rpc/silence_guard.h"

namespace amhex::client {
namespace {

constexpr int64_t kDefaultChunkBytes = int64_t{1024} * 1024;
// Room for so much of a download is made at once; beyond it the server's word for a size is not
// enough.
constexpr int64_t kMaxReservedBytes = int64_t{1} << 30;

absl::Status CheckEncoding(const v1::MeshingResult& result) {
  if (result.encoding() == v1::MESH_ENCODING_ARRAYS) return absl::OkStatus();
  return absl::UnimplementedError(absl::StrCat(
      "the result has encoding ", static_cast<int>(result.encoding()), ", which is not known"));
}

}  // namespace

absl::StatusOr<v1::QueryWriteStatusResponse> Client::Implementation::QueryWriteStatus(
    const v1::BlobRef& blob) {
  v1::QueryWriteStatusRequest query;
  *query.mutable_blob() = blob;
  v1::QueryWriteStatusResponse there;
  const absl::Status status =
      Call<v1::Blobs::Stub>(blobs.get(), &v1::Blobs::Stub::QueryWriteStatus, query, &there);
  if (!status.ok()) return status;
  return there;
}

absl::Status Client::Implementation::WriteFrom(
    std::string_view bytes, const v1::BlobRef& blob, int64_t chunk_bytes,
    const std::function<void(int64_t, int64_t)>& on_progress, int64_t* committed) {
  InterruptibleCall call(options);
  v1::WriteBlobResponse response;
  const auto writer = blobs->WriteBlob(call.context(), &response);
  SilenceGuard silence(call.context(), kTransferSilenceFactor * options.longest_silence);
  int64_t offset = *committed;
  bool open = true;
  v1::WriteBlobRequest
      request;  // one for all chunks: fresh pages for each cost more than sending it
  *request.mutable_blob() = blob;
  do {
    const int64_t length = std::min(chunk_bytes, blob.size_bytes() - offset);
    request.set_offset(offset);
    request.set_data(bytes.data() + offset, static_cast<size_t>(length));
    request.set_finish(offset + length == blob.size_bytes());
    open = writer->Write(request);  // false when the server has answered early
    request.clear_blob();           // the first chunk has named it
    silence.Renew();
    offset += length;
    if (open && on_progress) on_progress(offset, blob.size_bytes());
  } while (open && offset < blob.size_bytes());
  writer->WritesDone();
  absl::Status status = silence.Verdict(FromGrpcStatus(writer->Finish()));
  if (status.ok()) *committed = response.committed_size();
  return status;
}

absl::StatusOr<v1::BlobRef> Client::Upload(
    std::string_view bytes, const std::function<void(int64_t, int64_t)>& on_progress) {
  const absl::StatusOr<v1::Limits> limits = implementation_->GetLimits();
  if (!limits.ok()) return limits.status();
  v1::BlobRef blob;
  blob.set_sha256(Sha256Hex(bytes));
  blob.set_size_bytes(static_cast<int64_t>(bytes.size()));
  if (limits->max_blob_bytes() > 0 && blob.size_bytes() > limits->max_blob_bytes()) {
    return absl::InvalidArgumentError(absl::StrCat("the input has ", blob.size_bytes(),
                                                   " bytes; the server takes at most ",
                                                   limits->max_blob_bytes()));
  }
  const int64_t chunk_bytes =
      limits->preferred_chunk_bytes() > 0 ? limits->preferred_chunk_bytes() : kDefaultChunkBytes;
  Patience patience = implementation_->NewPatience();
  int64_t known = -1;
  absl::Status failure;  // of the last stream, until it has been waited for
  while (true) {
    const absl::StatusOr<v1::QueryWriteStatusResponse> there =
        implementation_->QueryWriteStatus(blob);
    if (!there.ok()) return there.status();
    if (there->complete()) return blob;
    int64_t committed = there->committed_size();
    // However long a stream took: what counts is whether it moved anything.
    if (committed > known) patience.Renew();
    known = std::max(known, committed);
    if (!failure.ok()) {
      if (!patience.ShouldRetry(failure)) return implementation_->Named(failure);
      failure = absl::OkStatus();
      continue;  // what was under way may have arrived meanwhile
    }
    failure = implementation_->WriteFrom(bytes, blob, chunk_bytes, on_progress, &committed);
    if (failure.ok() && committed == blob.size_bytes()) return blob;
    // Another offset than ours, or an early end: ask again where to go on.
    if (failure.ok() || ReasonOf(failure) == "WRONG_OFFSET") {
      failure = absl::UnavailableError("the upload did not end");
    }
    if (!patience.MayPass(failure)) return implementation_->Named(failure);
  }
}

absl::Status Client::Implementation::ReadInto(
    const v1::BlobRef& blob, const std::function<void(int64_t, int64_t)>& on_progress,
    std::string* bytes) {
  v1::ReadBlobRequest request;
  *request.mutable_blob() = blob;
  request.set_offset(static_cast<int64_t>(bytes->size()));
  InterruptibleCall call(options);
  const auto reader = blobs->ReadBlob(call.context(), request);
  SilenceGuard silence(call.context(), kTransferSilenceFactor * options.longest_silence);
  v1::ReadBlobResponse response;
  while (reader->Read(&response)) {
    silence.Renew();
    const auto have = static_cast<int64_t>(bytes->size());
    const auto more = static_cast<int64_t>(response.data().size());
    if (response.offset() != have || more > blob.size_bytes() - have) {
      call.context()->TryCancel();
      reader->Finish();
      return absl::DataLossError(absl::StrCat("bytes ", response.offset(), " to ",
                                              response.offset() + more, " came where byte ", have,
                                              " of ", blob.size_bytes(), " was due"));
    }
    bytes->append(response.data());
    if (on_progress) on_progress(have + more, blob.size_bytes());
  }
  return silence.Verdict(FromGrpcStatus(reader->Finish()));
}

absl::Status Client::Implementation::ReadRest(
    const v1::BlobRef& blob, const std::function<void(int64_t, int64_t)>& on_progress,
    std::string* bytes) {
  Patience patience = NewPatience();
  bytes->reserve(static_cast<size_t>(std::clamp<int64_t>(blob.size_bytes(), 0, kMaxReservedBytes)));
  while (bytes->empty() || static_cast<int64_t>(bytes->size()) < blob.size_bytes()) {
    const size_t before = bytes->size();
    absl::Status status = ReadInto(blob, on_progress, bytes);
    if (bytes->size() > before) patience.Renew();
    if (status.ok() && static_cast<int64_t>(bytes->size()) == blob.size_bytes()) break;
    if (status.ok()) status = absl::UnavailableError("the download ended early");
    if (!patience.ShouldRetry(status)) return Named(status);
  }
  if (Sha256Hex(*bytes) == blob.sha256()) return absl::OkStatus();
  return absl::DataLossError("the bytes received do not have the SHA-256 announced");
}

absl::StatusOr<std::string> Client::Download(
    const v1::BlobRef& blob, const std::function<void(int64_t, int64_t)>& on_progress) {
  std::string bytes;
  const absl::Status status = implementation_->ReadRest(blob, on_progress, &bytes);
  if (!status.ok()) return status;
  return bytes;
}

absl::StatusOr<AtMostHexaMesh> Client::FetchMesh(
    const v1::MeshingResult& result, const std::function<void(int64_t, int64_t)>& on_progress) {
  const absl::Status known = CheckEncoding(result);
  if (!known.ok()) return known;
  const absl::StatusOr<std::string> bytes = Download(result.mesh(), on_progress);
  if (!bytes.ok()) return bytes.status();
  return Implementation::CheckedMesh(result, *bytes);
}

absl::StatusOr<AtMostHexaMesh> Client::Implementation::CheckedMesh(const v1::MeshingResult& result,
                                                                   std::string_view bytes) {
  const absl::Status known = CheckEncoding(result);
  if (!known.ok()) return known;
  absl::StatusOr<AtMostHexaMesh> mesh = DecodeMesh(bytes);
  if (!mesh.ok()) return mesh;
  const auto cells = static_cast<int64_t>(mesh->corners.size());
  const auto vertices = static_cast<int64_t>(mesh->vertices.size());
  const v1::MeshStatistics& told = result.statistics();
  if (cells != told.cell_count() || vertices != told.vertex_count()) {
    return absl::DataLossError(absl::StrCat("the mesh has ", cells, " cells and ", vertices,
                                            " vertices, but ", told.cell_count(), " and ",
                                            told.vertex_count(), " were announced"));
  }
  for (const v1::CellTypeCount& count : told.cells_by_type()) {
    const auto found = std::count_if(mesh->types.begin(), mesh->types.end(), [&](auto type) {
      return static_cast<int>(type) == static_cast<int>(count.type());
    });
    if (found != count.cell_count()) {
      return absl::DataLossError(absl::StrCat("the mesh has ", found, " cells of type ",
                                              static_cast<int>(count.type()), ", but ",
                                              count.cell_count(), " were announced"));
    }
  }
  const absl::Status lawful = CheckMesh(*mesh);
  if (!lawful.ok()) return lawful;
  return mesh;
}

}  // namespace amhex::client
