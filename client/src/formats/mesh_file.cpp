#include "formats/mesh_file.h"

#include <array>
#include <filesystem>
#include <string_view>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "formats/boundary_surface.h"
#include "formats/hull_reader.h"
#include "formats/hull_writer.h"
#include "formats/status_macros.h"

namespace amhex::client {
namespace {

constexpr std::array<std::pair<std::string_view, MeshFormat>, 5> kExtensions = {
    {{".vtu", MeshFormat::kVtu},
     {".mesh", MeshFormat::kMedit},
     {".vtk", MeshFormat::kVtk},
     {".msh", MeshFormat::kGmsh},
     {".inp", MeshFormat::kAbaqus}}};
constexpr const char* kFoamFolder = "polyMesh";

absl::StatusOr<std::string> FormatMesh(const MeshDocument& document, MeshFormat format) {
  switch (format) {
    case MeshFormat::kVtu:
      return FormatVtu(document);
    case MeshFormat::kMedit:
      return FormatMedit(document);
    case MeshFormat::kVtk:
      return FormatVtk(document);
    case MeshFormat::kGmsh:
      return FormatGmsh(document);
    case MeshFormat::kAbaqus:
      return FormatAbaqus(document);
    case MeshFormat::kFoam:
      break;
  }
  return absl::InternalError("not the format of one file");
}

absl::StatusOr<MeshDocument> ReadMesh(std::string_view bytes, MeshFormat format) {
  switch (format) {
    case MeshFormat::kVtu:
      return ReadVtu(bytes);
    case MeshFormat::kMedit:
      return ReadMedit(bytes);
    case MeshFormat::kVtk:
      return ReadVtk(bytes);
    case MeshFormat::kGmsh:
      return ReadGmsh(bytes);
    case MeshFormat::kAbaqus:
    case MeshFormat::kFoam:
      break;
  }
  return absl::InternalError("not a format that is read");
}

absl::Status WriteFoam(const MeshDocument& document, const std::string& path) {
  AMHEX_ASSIGN_OR_RETURN(const std::vector<FoamFile> files, FormatFoam(document));
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) {
    return absl::FailedPreconditionError(absl::StrCat(path, ": cannot be made: ", error.message()));
  }
  for (const FoamFile& file : files) {
    AMHEX_RETURN_IF_ERROR(WriteWholeFile(absl::StrCat(path, "/", file.name), file.content));
  }
  return absl::OkStatus();
}

}  // namespace

std::vector<double> NumbersOf(const MeshFact& fact) {
  if (const auto* number = std::get_if<double>(&fact.value)) return {*number};
  if (const auto* list = std::get_if<std::vector<double>>(&fact.value)) return *list;
  return {};
}

std::string TextOfCodes(const std::vector<double>& codes) {
  std::string text;
  for (double code : codes) {
    if (code > 0 && code < 256) text += static_cast<char>(static_cast<unsigned char>(code));
  }
  return text;
}

std::string TextOf(const MeshFact& fact) {
  if (const auto* number = std::get_if<double>(&fact.value)) {
    return absl::StrFormat("%.10g", *number);
  }
  if (const auto* text = std::get_if<std::string>(&fact.value)) return *text;
  return absl::StrCat(NumbersOf(fact).size(), " numbers");
}

std::optional<MeshFormat> MeshFormatOfPath(const std::string& path) {
  const std::filesystem::path name = std::filesystem::path(path).filename();
  if (name == kFoamFolder) return MeshFormat::kFoam;
  const std::string extension = absl::AsciiStrToLower(name.extension().string());
  for (const auto& [known, format] : kExtensions) {
    if (extension == known) return format;
  }
  return std::nullopt;
}

bool IsReadable(MeshFormat format) {
  return format != MeshFormat::kAbaqus && format != MeshFormat::kFoam;
}

bool IsWritableMeshPath(const std::string& path) {
  const std::optional<HullFormat> surface = HullFormatOfPath(path);
  return MeshFormatOfPath(path).has_value() || (surface && *surface != HullFormat::kXyz);
}

absl::Status WriteMeshFile(const MeshDocument& document, const std::string& path) {
  if (HullFormatOfPath(path)) return WriteBoundarySurface(document.mesh, path);
  const std::optional<MeshFormat> format = MeshFormatOfPath(path);
  if (!format) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": unknown extension; meshes are written to ", kMeshOutputExtensions));
  }
  if (*format == MeshFormat::kFoam) return WriteFoam(document, path);
  AMHEX_ASSIGN_OR_RETURN(const std::string bytes, FormatMesh(document, *format));
  return WriteWholeFile(path, bytes);
}

absl::StatusOr<MeshDocument> ReadMeshFile(const std::string& path) {
  const std::optional<MeshFormat> format = MeshFormatOfPath(path);
  if (!format || !IsReadable(*format)) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": volume meshes are read from ", kMeshExtensions));
  }
  AMHEX_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(path));
  absl::StatusOr<MeshDocument> document = ReadMesh(bytes, *format);
  if (!document.ok()) {
    return absl::Status(document.status().code(),
                        absl::StrCat(path, ": ", std::string(document.status().message())));
  }
  return document;
}

}  // namespace amhex::client
