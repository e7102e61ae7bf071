// Uploads: chunks as they come from the wire, at any offset, over streams that replace each other.
// What is stored, and what each call says, is compared with a string that grows, and the reading
// of a message with protobuf's own.
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>

#include "blob_frames.h"
#include "blob_store.h"
#include "errors.h"
#include "files.h"
#include "google/protobuf/stubs/logging.h"
#include "sha256.h"

namespace amhex::server {
namespace {

constexpr int kBlobBytes = 200;  // a chunk's length is one byte, so that some go beyond the end
constexpr char kTenant[] = "tenant";

void Expect(bool condition) {
  if (!condition) std::abort();
}

// The steps of a run.
class Steps {
 public:
  Steps(const uint8_t* data, size_t size) : data_(data), left_(size) {}
  bool AtEnd() const { return left_ == 0; }
  uint8_t Byte() {
    if (left_ == 0) return 0;
    --left_;
    return *data_++;
  }
  std::string Bytes(size_t count) {
    count = std::min(count, left_);
    const std::string bytes(reinterpret_cast<const char*>(data_), count);
    data_ += count;
    left_ -= count;
    return bytes;
  }
  int64_t Number() {
    uint64_t number = 0;
    for (int i = 0; i < 8; ++i) number = number << 8 | Byte();
    return static_cast<int64_t>(number);
  }

 private:
  const uint8_t* data_;
  size_t left_;
};

// A store of this process's own, used by one run after the other; in memory where there is some for
// files, for a disk would be waited for at every end of an upload.
struct Place {
  std::string folder = MakeFolder();
  std::unique_ptr<BlobStore> store = *BlobStore::Open(folder, Limits());
  ~Place() {
    std::error_code error;
    std::filesystem::remove_all(folder, error);
  }
  static std::string MakeFolder() {
    const bool has_memory = access("/dev/shm", W_OK) == 0;
    const std::filesystem::path parent =
        has_memory ? "/dev/shm" : std::filesystem::temp_directory_path();
    std::string path = (parent / "upload-XXXXXX").string();
    Expect(mkdtemp(path.data()) != nullptr);
    return path;
  }
};

std::string BlobBytes() {
  std::string bytes;
  for (int i = 0; i < kBlobBytes; ++i) bytes += static_cast<char>(7 * i);
  return bytes;
}

class Run {
 public:
  explicit Run(BlobStore* store) : store_(store) {
    blob_.set_sha256(Sha256Hex(content_));
    blob_.set_size_bytes(kBlobBytes);
    Reopen();
  }
  ~Run() {
    upload_.reset();
    store_->Collect(absl::InfinitePast(), absl::InfiniteFuture(),
                    [](const std::string&, const auto&) { return false; });
  }

  void Step(Steps* steps) {
    switch (steps->Byte() % 6) {
      case 0: {
        const auto size = static_cast<size_t>(steps->Byte());
        const std::string rest = content_.substr(std::min(stored_.size(), content_.size()));
        return Store(static_cast<int64_t>(stored_.size()), rest.substr(0, size));
      }
      case 1: {
        const int64_t offset = steps->Number();
        return Store(offset, steps->Bytes(steps->Byte()));
      }
      case 2:
        return Store(static_cast<int64_t>(stored_.size()), steps->Bytes(steps->Byte()));
      case 3:
        return Reopen();
      case 4:
        return Finish();
      default:
        return Receive(steps->Bytes(steps->Byte()));
    }
  }

 private:
  // The older stream may no longer write, and takes nothing along.
  void Reopen() {
    auto next = store_->StartUpload(kTenant, blob_);
    Expect(next.ok());
    if (upload_ && !is_over_) {
      Expect(absl::IsAborted(upload_->Write(static_cast<int64_t>(stored_.size()), "x", 1)));
    }
    upload_ = *std::move(next);
    if (is_over_) stored_.clear();
    is_over_ = false;
    ExpectStored();
  }

  void ExpectStored() {
    Expect(upload_->committed_size() == static_cast<int64_t>(stored_.size()));
    Expect(store_->UploadedSize(kTenant, blob_.sha256()) == upload_->committed_size());
  }

  void Store(int64_t offset, const std::string& bytes) {
    const size_t half = bytes.size() / 2;
    const std::string_view view = bytes;
    const BytePieces pieces{view.substr(0, half), view.substr(half)};
    const absl::Status status = upload_->Store(offset, pieces);
    if (is_over_) return Expect(status.ok() == upload_->complete());
    if (offset != static_cast<int64_t>(stored_.size())) {
      Expect(absl::IsOutOfRange(status));
    } else if (stored_.size() + bytes.size() > kBlobBytes) {
      Expect(absl::IsInvalidArgument(status));
    } else {
      Expect(status.ok() && upload_->Digest(pieces).ok());
      stored_ += bytes;
    }
    ExpectStored();
  }

  void Finish() {
    const absl::Status status = upload_->Finish();
    if (is_over_) return Expect(status.ok() == upload_->complete());
    Expect(status.ok() == (stored_ == content_));
    if (stored_.size() < kBlobBytes) {
      Expect(absl::IsInvalidArgument(status));
      return ExpectStored();
    }
    is_over_ = true;
    Expect(store_->UploadedSize(kTenant, blob_.sha256()) == 0);
    if (!status.ok()) return Expect(ReasonOf(status) == "DIGEST_MISMATCH");
    const auto kept = ReadWholeFile(store_->PathOf(blob_.sha256()));
    Expect(kept.ok() && *kept == content_);
  }

  // A message from the wire, in two slices.
  void Receive(const std::string& bytes) {
    amhex::v1::WriteBlobRequest request;
    const bool is_request = request.ParseFromString(bytes);
    const size_t half = bytes.size() / 2;
    const grpc::Slice slices[] = {grpc::Slice(bytes.substr(0, half)),
                                  grpc::Slice(bytes.substr(half))};
    ReceivedChunk chunk;
    chunk.buffer = grpc::ByteBuffer(slices, 2);
    const bool is_chunk = ParseChunk(&chunk).ok();
    // The stream that chunks are read from takes tags of more bytes than protobuf's own parser.
    if (!is_request) return;
    Expect(is_chunk);
    std::string data;
    for (const std::string_view piece : chunk.data) data += piece;
    Expect(data == request.data() && chunk.offset == request.offset());
    Expect(chunk.finish == request.finish());
    Expect(chunk.blob.SerializeAsString() == request.blob().SerializeAsString());
    Store(chunk.offset, data);
  }

  BlobStore* const store_;
  const std::string content_ = BlobBytes();
  amhex::v1::BlobRef blob_;
  std::unique_ptr<BlobUpload> upload_;
  std::string stored_;
  bool is_over_ = false;  // complete, or dropped for its digest
};

}  // namespace
}  // namespace amhex::server

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace amhex::server;
  static const auto kSilenced = google::protobuf::SetLogHandler(nullptr);
  static_cast<void>(kSilenced);
  static const Place kPlace;
  Steps steps(data, size);
  Run run(kPlace.store.get());
  while (!steps.AtEnd()) run.Step(&steps);
  return 0;
}
