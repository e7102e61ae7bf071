#include "formats/mesh_file.h"

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "formats/hull_reader.h"
#include "formats/hull_writer.h"
#include "formats/status_macros.h"

namespace amhex::client {
namespace {

absl::Status UnknownExtension(const std::string& path) {
  return absl::InvalidArgumentError(
      absl::StrCat(path, ": unknown extension; volume meshes are ", kMeshExtensions));
}

}  // namespace

std::optional<MeshFormat> MeshFormatOfPath(const std::string& path) {
  const size_t dot = path.rfind('.');
  if (dot == std::string::npos) return std::nullopt;
  const std::string extension = absl::AsciiStrToLower(path.substr(dot));
  if (extension == ".vtu") return MeshFormat::kVtu;
  if (extension == ".mesh") return MeshFormat::kMedit;
  return std::nullopt;
}

absl::Status WriteMeshFile(const MeshDocument& document, const std::string& path) {
  const std::optional<MeshFormat> format = MeshFormatOfPath(path);
  if (!format) return UnknownExtension(path);
  return WriteWholeFile(path,
                        *format == MeshFormat::kVtu ? FormatVtu(document) : FormatMedit(document));
}

absl::StatusOr<MeshDocument> ReadMeshFile(const std::string& path) {
  const std::optional<MeshFormat> format = MeshFormatOfPath(path);
  if (!format) return UnknownExtension(path);
  AMHEX_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(path));
  absl::StatusOr<MeshDocument> document =
      *format == MeshFormat::kVtu ? ReadVtu(bytes) : ReadMedit(bytes);
  if (!document.ok()) {
    return absl::Status(document.status().code(),
                        absl::StrCat(path, ": ", std::string(document.status().message())));
  }
  return document;
}

}  // namespace amhex::client
