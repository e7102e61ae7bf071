// File descriptors and durable files.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace amhex::server {

// Owns a file descriptor.
class UniqueFd {
 public:
  UniqueFd() = default;
  explicit UniqueFd(int fd) : fd_(fd) {}
  ~UniqueFd() { Reset(); }
  UniqueFd(UniqueFd&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  UniqueFd& operator=(UniqueFd&& other) noexcept {
    if (this != &other) {
      Reset();
      fd_ = std::exchange(other.fd_, -1);
    }
    return *this;
  }
  int get() const { return fd_; }
  bool valid() const { return fd_ >= 0; }
  void Reset();

 private:
  int fd_ = -1;
};

// The error for a failed system call: STORAGE_FULL when the disk or quota is full, else a fault
// that names `what` and the system's reason, never a path.
absl::Status FileError(const std::string& what, int error_number);

absl::StatusOr<UniqueFd> OpenFile(const std::string& path, int flags, mode_t mode = 0600);
absl::Status WriteAllAt(int fd, const void* data, size_t size, int64_t offset);
// The same for bytes in pieces, one after the other.
absl::Status WritePiecesAt(int fd, const std::vector<std::string_view>& pieces, int64_t offset);
// Bytes read; fewer than `size` only at the file's end.
absl::StatusOr<size_t> ReadAt(int fd, void* data, size_t size, int64_t offset);
absl::StatusOr<int64_t> FileSize(int fd);
absl::StatusOr<std::string> ReadWholeFile(const std::string& path);

// Regular files in a folder and in those within it, as far as it can be read; and their bytes.
std::vector<std::filesystem::path> FilesBelow(const std::string& folder);
int64_t BytesBelow(const std::string& folder);

// Makes `path` and its parents; OK if they exist.
absl::Status MakeFolders(const std::string& path);
absl::Status SyncFile(int fd);
// Lets the disk begin with a part of a file, so that SyncFile finds less to do. A hint only.
void StartWriteback(int fd, int64_t offset, int64_t size);
// Renames within one file system and makes the new entry durable.
absl::Status RenameDurably(const std::string& from, const std::string& to);
// Writes a small file so that readers see all of it or nothing.
absl::Status WriteFileAtomically(const std::string& path, const std::string& bytes);

}  // namespace amhex::server
