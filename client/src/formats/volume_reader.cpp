#include "formats/volume_reader.h"

#include <new>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "formats/hull_reader.h"
#include "formats/mesh_file.h"
#include "formats/status_macros.h"
#include "formats/volume_builder.h"

namespace amhex::client {
namespace {

absl::StatusOr<VolumeMesh> FromDocument(absl::StatusOr<MeshDocument> document) {
  if (!document.ok()) return document.status();
  VolumeBuilder builder;
  builder.mesh.vertices = std::move(document->mesh.vertices);
  for (const CellCorners& corners : document->mesh.corners) builder.AddCorners(corners);
  return std::move(builder.mesh);
}

absl::StatusOr<VolumeMesh> ReadVolume(VolumeFormat format, std::string_view bytes) {
  if (bytes.empty()) return absl::InvalidArgumentError("the file is empty");
  try {
    switch (format) {
      case VolumeFormat::kVtk:
        return ReadVtkVolume(bytes);
      case VolumeFormat::kGmsh:
        return ReadGmshVolume(bytes);
      case VolumeFormat::kVtu:
        return ReadVtuVolume(bytes);
      case VolumeFormat::kMedit:
        return ReadMeditVolume(bytes);
    }
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError("not enough memory to read the file");
  }
  return absl::InternalError("unknown volume format");
}

}  // namespace

std::optional<VolumeFormat> VolumeFormatOfPath(const std::string& path) {
  const size_t dot = path.rfind('.');
  if (dot == std::string::npos) return std::nullopt;
  const std::string extension = absl::AsciiStrToLower(path.substr(dot));
  if (extension == ".vtk") return VolumeFormat::kVtk;
  if (extension == ".msh") return VolumeFormat::kGmsh;
  if (extension == ".vtu") return VolumeFormat::kVtu;
  if (extension == ".mesh") return VolumeFormat::kMedit;
  return std::nullopt;
}

absl::StatusOr<VolumeMesh> ReadMeditVolume(std::string_view bytes) {
  return FromDocument(ReadMedit(bytes));
}

absl::StatusOr<VolumeMesh> ReadVolumeFile(const std::string& path) {
  const std::optional<VolumeFormat> format = VolumeFormatOfPath(path);
  if (!format) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": unknown extension; volume meshes are read from ", kVolumeExtensions));
  }
  AMHEX_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(path));
  absl::StatusOr<VolumeMesh> volume = ReadVolume(*format, bytes);
  if (!volume.ok()) {
    return absl::Status(volume.status().code(),
                        absl::StrCat(path, ": ", std::string(volume.status().message())));
  }
  return volume;
}

}  // namespace amhex::client
