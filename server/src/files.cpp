#include "files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <system_error>

#include "errors.h"

namespace amhex::server {
namespace {

// Far below the kernel's IOV_MAX of 1024; a chunk of 1 MiB comes in about as many.
constexpr size_t kPiecesPerCall = 128;

std::string FolderOf(const std::string& path) {
  const std::string parent = std::filesystem::path(path).parent_path().string();
  return parent.empty() ? "." : parent;
}

absl::Status SyncFolder(const std::string& folder) {
  auto fd = OpenFile(folder, O_RDONLY | O_DIRECTORY);
  if (!fd.ok()) return fd.status();
  return SyncFile(fd->get());
}

}  // namespace

void UniqueFd::Reset() {
  if (fd_ >= 0) close(fd_);
  fd_ = -1;
}

absl::Status FileError(const std::string& what, int error_number) {
  const std::string reason = std::generic_category().message(error_number);
  if (error_number == ENOSPC || error_number == EDQUOT || error_number == EFBIG) {
    return MakeError(absl::StatusCode::kResourceExhausted, amhex::v1::STORAGE_FULL,
                     what + ": " + reason);
  }
  return ServerFault(what + ": " + reason);
}

absl::StatusOr<UniqueFd> OpenFile(const std::string& path, int flags, mode_t mode) {
  const int fd = open(path.c_str(), flags | O_CLOEXEC, mode);
  if (fd < 0) return FileError("cannot open a file of the store", errno);
  return UniqueFd(fd);
}

absl::Status WriteAllAt(int fd, const void* data, size_t size, int64_t offset) {
  const char* bytes = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = pwrite(fd, bytes, size, offset);
    if (written < 0) {
      if (errno == EINTR) continue;
      return FileError("cannot write a file of the store", errno);
    }
    bytes += written;
    size -= static_cast<size_t>(written);
    offset += written;
  }
  return absl::OkStatus();
}

absl::Status WritePiecesAt(int fd, const std::vector<std::string_view>& pieces, int64_t offset) {
  std::array<iovec, kPiecesPerCall> batch;
  for (size_t next = 0; next < pieces.size();) {
    const size_t count = std::min(pieces.size() - next, batch.size());
    int64_t wanted = 0;
    for (size_t i = 0; i < count; ++i) {
      const std::string_view& piece = pieces[next + i];
      batch[i] = {const_cast<char*>(piece.data()), piece.size()};
      wanted += static_cast<int64_t>(piece.size());
    }
    const ssize_t written = pwritev(fd, batch.data(), static_cast<int>(count), offset);
    if (written < 0 && errno != EINTR) return FileError("cannot write a file of the store", errno);
    if (written == wanted) {
      next += count;
      offset += wanted;
      continue;
    }
    // Interrupted: one piece the plain way, then on.
    const std::string_view& piece = pieces[next++];
    auto status = WriteAllAt(fd, piece.data(), piece.size(), offset);
    if (!status.ok()) return status;
    offset += static_cast<int64_t>(piece.size());
  }
  return absl::OkStatus();
}

std::vector<std::filesystem::path> FilesBelow(const std::string& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (std::filesystem::recursive_directory_iterator it(folder, error), end; it != end;
       it.increment(error)) {
    if (error) break;
    if (it->is_regular_file(error)) files.push_back(it->path());
  }
  return files;
}

int64_t BytesBelow(const std::string& folder) {
  int64_t total = 0;
  std::error_code error;
  for (const std::filesystem::path& file : FilesBelow(folder)) {
    const auto size = std::filesystem::file_size(file, error);
    if (!error) total += static_cast<int64_t>(size);
  }
  return total;
}

absl::StatusOr<size_t> ReadAt(int fd, void* data, size_t size, int64_t offset) {
  char* bytes = static_cast<char*>(data);
  size_t total = 0;
  while (total < size) {
    const ssize_t got = pread(fd, bytes + total, size - total, offset + static_cast<off_t>(total));
    if (got < 0) {
      if (errno == EINTR) continue;
      return FileError("cannot read a file of the store", errno);
    }
    if (got == 0) break;
    total += static_cast<size_t>(got);
  }
  return total;
}

absl::StatusOr<int64_t> FileSize(int fd) {
  struct stat info;
  if (fstat(fd, &info) != 0) return FileError("cannot examine a file of the store", errno);
  return static_cast<int64_t>(info.st_size);
}

absl::StatusOr<std::string> ReadWholeFile(const std::string& path) {
  auto fd = OpenFile(path, O_RDONLY);
  if (!fd.ok()) return fd.status();
  auto size = FileSize(fd->get());
  if (!size.ok()) return size.status();
  std::string bytes(static_cast<size_t>(*size), '\0');
  auto got = ReadAt(fd->get(), bytes.data(), bytes.size(), 0);
  if (!got.ok()) return got.status();
  bytes.resize(*got);
  return bytes;
}

absl::Status MakeFolders(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) return FileError("cannot make a folder of the store", error.value());
  return absl::OkStatus();
}

absl::Status SyncFile(int fd) {
  if (fsync(fd) != 0) return FileError("cannot make a file durable", errno);
  return absl::OkStatus();
}

void StartWriteback(int fd, int64_t offset, int64_t size) {
  sync_file_range(fd, offset, size, SYNC_FILE_RANGE_WRITE);
}

absl::Status RenameDurably(const std::string& from, const std::string& to) {
  if (rename(from.c_str(), to.c_str()) != 0) {
    return FileError("cannot publish a file of the store", errno);
  }
  return SyncFolder(FolderOf(to));
}

absl::Status WriteFileAtomically(const std::string& path, const std::string& bytes) {
  const std::string draft = path + ".new";
  auto fd = OpenFile(draft, O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (!fd.ok()) return fd.status();
  if (auto status = WriteAllAt(fd->get(), bytes.data(), bytes.size(), 0); !status.ok()) {
    return status;
  }
  return RenameDurably(draft, path);
}

}  // namespace amhex::server
