#include "formats/hull_reader.h"

#include <sys/stat.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <new>
#include <system_error>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "formats/status_macros.h"
#include "formats/volume_reader.h"

namespace amhex::client {
namespace {

absl::Status CannotOpen(const std::string& path, int error) {
  const std::string message = absl::StrCat(path, ": ", std::generic_category().message(error));
  if (error == ENOENT || error == ENOTDIR) return absl::NotFoundError(message);
  if (error == EACCES) return absl::PermissionDeniedError(message);
  return absl::InvalidArgumentError(message);
}

}  // namespace

std::optional<HullFormat> HullFormatOfPath(const std::string& path) {
  const size_t dot = path.rfind('.');
  if (dot == std::string::npos) return std::nullopt;
  const std::string extension = absl::AsciiStrToLower(path.substr(dot));
  if (extension == ".drc") return HullFormat::kDraco;
  if (extension == ".ply") return HullFormat::kPly;
  if (extension == ".obj") return HullFormat::kObj;
  if (extension == ".off") return HullFormat::kOff;
  if (extension == ".stl") return HullFormat::kStl;
  for (const char* const xyz : {".xyz", ".pts", ".asc"}) {
    if (extension == xyz) return HullFormat::kXyz;
  }
  return std::nullopt;
}

absl::StatusOr<std::string> ReadWholeFile(const std::string& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                             &std::fclose);
  if (!file) return CannotOpen(path, errno);
  struct stat info {};
  if (fstat(fileno(file.get()), &info) != 0) return CannotOpen(path, errno);
  if (!S_ISREG(info.st_mode)) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": is not a regular file"));
  }
  if (info.st_size > kMaxInputFileBytes) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": has ", info.st_size, " bytes; at most ",
                                                   kMaxInputFileBytes, " are read"));
  }
  std::string bytes(static_cast<size_t>(info.st_size), '\0');
  const size_t count = std::fread(bytes.data(), 1, bytes.size(), file.get());
  if (std::ferror(file.get()) != 0) return CannotOpen(path, errno);
  bytes.resize(count);
  return bytes;
}

absl::StatusOr<InputHull> ReadHull(HullFormat format, std::string_view bytes) {
  if (bytes.empty()) return absl::InvalidArgumentError("the file is empty");
  try {
    switch (format) {
      case HullFormat::kDraco:
        return ReadDraco(bytes);
      case HullFormat::kPly:
        return ReadPly(bytes);
      case HullFormat::kObj:
        return ReadObj(bytes);
      case HullFormat::kOff:
        return ReadOff(bytes);
      case HullFormat::kStl:
        return ReadStl(bytes);
      case HullFormat::kXyz:
        return ReadXyz(bytes);
    }
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError("not enough memory to read the file");
  }
  return absl::InternalError("unknown input format");
}

absl::StatusOr<InputHull> ReadHullFile(const std::string& path) {
  const std::optional<HullFormat> format = HullFormatOfPath(path);
  if (!format) {
    std::error_code error;
    if (!std::filesystem::exists(path, error)) {
      return CannotOpen(path, ENOENT);
    }
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": unknown extension; surfaces and clouds are read from ",
                     kHullExtensions, ", volume meshes from ", kVolumeExtensions));
  }
  AMHEX_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(path));
  absl::StatusOr<InputHull> hull = ReadHull(*format, bytes);
  if (!hull.ok()) {
    return absl::Status(hull.status().code(),
                        absl::StrCat(path, ": ", std::string(hull.status().message())));
  }
  return hull;
}

}  // namespace amhex::client
