// How much room blobs take, how much there is, and how some is made.
#include <sys/stat.h>
#include <sys/statvfs.h>

#include <cerrno>
#include <filesystem>

#include "blob_store.h"
#include "errors.h"
#include "status_macros.h"

namespace amhex::server {
namespace {

namespace fs = std::filesystem;

absl::Time LastTouched(const fs::path& path) {
  struct stat info;
  if (stat(path.c_str(), &info) != 0) return absl::Now();
  return absl::TimeFromTimespec(info.st_mtim);
}

}  // namespace

int64_t BlobStore::total_bytes() const { return total_bytes_; }

int64_t BlobStore::uploading_bytes() const { return uploading_bytes_; }

bool BlobStore::HasBudgetFor(int64_t more_bytes) const {
  const int64_t budget = limits_.max_blob_store_bytes;
  return budget <= 0 || total_bytes() + uploading_bytes() + more_bytes <= budget;
}

absl::Status BlobStore::CheckRoom(int64_t more_bytes) const {
  if (HasBudgetFor(more_bytes)) return absl::OkStatus();
  return MakeError(absl::StatusCode::kResourceExhausted, amhex::v1::STORAGE_FULL,
                   "the blob store is at its limit of " +
                       std::to_string(limits_.max_blob_store_bytes) + " bytes");
}

absl::StatusOr<int64_t> BlobStore::FreeDiskBytes() const {
  struct statvfs info;
  if (statvfs(private_folder_.c_str(), &info) != 0) {
    return FileError("cannot ask for the room on the disk", errno);
  }
  return static_cast<int64_t>(info.f_bavail) * static_cast<int64_t>(info.f_frsize);
}

absl::Status BlobStore::CheckRoomForInput(int64_t more_bytes) const {
  AMHEX_RETURN_IF_ERROR(CheckRoom(more_bytes));
  const int64_t reserve = limits_.min_free_disk_bytes;
  if (reserve <= 0) return absl::OkStatus();
  AMHEX_ASSIGN_OR_RETURN(const int64_t left, FreeDiskBytes());
  if (left - more_bytes >= reserve) return absl::OkStatus();
  return MakeError(absl::StatusCode::kResourceExhausted, amhex::v1::STORAGE_FULL,
                   "the disk has " + std::to_string(left) + " bytes left, and keeps " +
                       std::to_string(reserve) + " for the queue and for results");
}

// Under the lock, under which streams begin. One that writes on into a removed file would later
// publish whatever another has begun under that name.
void BlobStore::CollectUpload(const std::string& key) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (partials_.contains(key)) return;
  std::error_code error;
  const auto size = fs::file_size(UploadPath(key), error);
  if (error || !fs::remove(UploadPath(key), error)) return;
  uploading_bytes_ -= static_cast<int64_t>(size);
}

// Hidden first and removed then: what was touched, or written anew, in the last moment comes back.
int64_t BlobStore::CollectBlob(const std::string& sha256, absl::Time older_than,
                               const Release& release) {
  const std::string shown = PathOf(sha256);
  const std::string hidden = private_folder_ + "/scratch/collected-" + sha256;
  bool is_hidden = false;
  const bool is_released = release(sha256, [&] {
    is_hidden |= LastTouched(shown) < older_than && rename(shown.c_str(), hidden.c_str()) == 0;
  });
  if (!is_hidden) return 0;
  int64_t freed = 0;
  std::error_code error;
  if (is_released && LastTouched(hidden) < older_than) {
    freed = static_cast<int64_t>(fs::file_size(hidden, error));
  } else {
    fs::create_hard_link(hidden, shown, error);  // does nothing if it was stored again
  }
  fs::remove(hidden, error);
  return freed;
}

int64_t BlobStore::Collect(absl::Time older_than, absl::Time uploads_older_than,
                           const Release& release) {
  int64_t freed = 0;
  for (const fs::path& file : FilesBelow(root_ + "/blobs")) {
    if (LastTouched(file) >= older_than) continue;
    freed += CollectBlob(file.filename().string(), older_than, release);
  }
  for (const fs::path& file : FilesBelow(private_folder_ + "/uploads")) {
    if (LastTouched(file) >= uploads_older_than) continue;
    CollectUpload(file.filename().string());
  }
  // What other servers have added and removed is seen here only.
  const bool is_shared = private_folder_ != root_;
  const int64_t found = is_shared ? BytesBelow(root_ + "/blobs") : 0;
  std::lock_guard<std::mutex> lock(mutex_);
  total_bytes_ = is_shared ? found : total_bytes_ - freed;
  return freed;
}

}  // namespace amhex::server
