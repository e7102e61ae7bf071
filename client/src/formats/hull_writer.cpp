#include "formats/hull_writer.h"

#include <sys/stat.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cstdio>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "formats/draco_encoder.h"
#include "formats/status_macros.h"

namespace amhex::client {
namespace {

static_assert(std::endian::native == std::endian::little, "the binary writers copy numbers as is");

template <class T>
void AppendNumber(T value, std::string* bytes) {
  const char* raw = reinterpret_cast<const char*>(&value);
  bytes->append(raw, sizeof(T));
}

void AppendVector(const Vec3d& v, std::string* bytes) {
  for (int axis = 0; axis < 3; ++axis) AppendNumber(v[axis], bytes);
}

std::string FormatPly(const InputHull& hull) {
  const auto* mesh = std::get_if<TriangleMesh>(&hull);
  const auto* cloud = std::get_if<PointCloud>(&hull);
  const std::vector<Vec3d>& positions = mesh != nullptr ? mesh->vertices : cloud->points;
  const bool has_normals = cloud != nullptr && !cloud->normals.empty();
  std::string bytes =
      absl::StrCat("ply\nformat binary_little_endian 1.0\nelement vertex ", positions.size(),
                   "\nproperty double x\nproperty double y\nproperty double z\n");
  if (has_normals) bytes += "property double nx\nproperty double ny\nproperty double nz\n";
  if (mesh != nullptr) {
    absl::StrAppend(&bytes, "element face ", mesh->triangles.size(),
                    "\nproperty list uchar int vertex_indices\n");
  }
  bytes += "end_header\n";
  for (size_t i = 0; i < positions.size(); ++i) {
    AppendVector(positions[i], &bytes);
    if (has_normals) AppendVector(cloud->normals[i], &bytes);
  }
  if (mesh == nullptr) return bytes;
  for (const auto& t : mesh->triangles) {
    AppendNumber<uint8_t>(3, &bytes);
    for (int32_t corner : t) AppendNumber(corner, &bytes);
  }
  return bytes;
}

std::string FormatObj(const InputHull& hull) {
  std::string text;
  if (const auto* cloud = std::get_if<PointCloud>(&hull)) {
    for (const Vec3d& p : cloud->points)
      absl::StrAppendFormat(&text, "v %.17g %.17g %.17g\n", p.x, p.y, p.z);
    for (const Vec3d& n : cloud->normals)
      absl::StrAppendFormat(&text, "vn %.17g %.17g %.17g\n", n.x, n.y, n.z);
    return text;
  }
  const auto& mesh = std::get<TriangleMesh>(hull);
  for (const Vec3d& p : mesh.vertices)
    absl::StrAppendFormat(&text, "v %.17g %.17g %.17g\n", p.x, p.y, p.z);
  for (const auto& t : mesh.triangles) {
    absl::StrAppend(&text, "f ", t[0] + 1, " ", t[1] + 1, " ", t[2] + 1, "\n");
  }
  return text;
}

std::string FormatOff(const InputHull& hull) {
  static const std::vector<std::array<int32_t, 3>> kNoTriangles;
  const auto* mesh = std::get_if<TriangleMesh>(&hull);
  const auto& positions = mesh != nullptr ? mesh->vertices : std::get<PointCloud>(hull).points;
  const auto& triangles = mesh != nullptr ? mesh->triangles : kNoTriangles;
  std::string text = absl::StrCat("OFF\n", positions.size(), " ", triangles.size(), " 0\n");
  for (const Vec3d& p : positions)
    absl::StrAppendFormat(&text, "%.17g %.17g %.17g\n", p.x, p.y, p.z);
  for (const auto& t : triangles) absl::StrAppend(&text, "3 ", t[0], " ", t[1], " ", t[2], "\n");
  return text;
}

absl::StatusOr<std::string> FormatStl(const InputHull& hull) {
  const auto* mesh = std::get_if<TriangleMesh>(&hull);
  if (mesh == nullptr) return absl::InvalidArgumentError("STL holds surfaces, not point clouds");
  constexpr size_t kHeaderBytes = 80;
  std::string bytes = "binary STL";
  bytes.resize(kHeaderBytes, ' ');
  AppendNumber(static_cast<uint32_t>(mesh->triangles.size()), &bytes);
  for (const auto& t : mesh->triangles) {
    const Vec3d &a = mesh->vertices[t[0]], &b = mesh->vertices[t[1]], &c = mesh->vertices[t[2]];
    for (const Vec3d& v : {Normalized(Cross(b - a, c - a)), a, b, c}) {
      for (int axis = 0; axis < 3; ++axis) AppendNumber(static_cast<float>(v[axis]), &bytes);
    }
    AppendNumber<uint16_t>(0, &bytes);
  }
  return bytes;
}

absl::StatusOr<std::string> FormatXyz(const InputHull& hull) {
  const auto* cloud = std::get_if<PointCloud>(&hull);
  if (cloud == nullptr) return absl::InvalidArgumentError("xyz holds point clouds, not surfaces");
  std::string text;
  for (size_t i = 0; i < cloud->points.size(); ++i) {
    const Vec3d& p = cloud->points[i];
    absl::StrAppendFormat(&text, "%.17g %.17g %.17g", p.x, p.y, p.z);
    if (!cloud->normals.empty()) {
      const Vec3d& n = cloud->normals[i];
      absl::StrAppendFormat(&text, " %.17g %.17g %.17g", n.x, n.y, n.z);
    }
    text += '\n';
  }
  return text;
}

absl::Status WriteError(const std::string& path, int error) {
  return absl::FailedPreconditionError(
      absl::StrCat(path, ": cannot be written: ", std::generic_category().message(error)));
}

}  // namespace

absl::StatusOr<std::string> FormatHull(const InputHull& hull, HullFormat format, double tolerance) {
  switch (format) {
    case HullFormat::kDraco: {
      AMHEX_ASSIGN_OR_RETURN(DracoEncoding encoding, EncodeDraco(hull, tolerance));
      return std::move(encoding.bytes);
    }
    case HullFormat::kPly:
      return FormatPly(hull);
    case HullFormat::kObj:
      return FormatObj(hull);
    case HullFormat::kOff:
      return FormatOff(hull);
    case HullFormat::kStl:
      return FormatStl(hull);
    case HullFormat::kXyz:
      return FormatXyz(hull);
  }
  return absl::InternalError("unknown output format");
}

absl::Status WriteHullFile(const InputHull& hull, const std::string& path, double tolerance) {
  const std::optional<HullFormat> format = HullFormatOfPath(path);
  if (!format) {
    return absl::InvalidArgumentError(absl::StrCat(
        path, ": unknown extension; surfaces and clouds are written to ", kHullExtensions));
  }
  AMHEX_ASSIGN_OR_RETURN(const std::string bytes, FormatHull(hull, *format, tolerance));
  return WriteWholeFile(path, bytes);
}

absl::Status WriteWholeFile(const std::string& path, const std::string& bytes) {
  // A device or pipe is written into, never replaced.
  struct stat info {};
  const bool in_place = stat(path.c_str(), &info) == 0 && !S_ISREG(info.st_mode);
  const std::string draft = in_place ? path : absl::StrCat(path, ".", getpid(), ".part");
  std::FILE* file = std::fopen(draft.c_str(), "wb");
  if (file == nullptr) return WriteError(path, errno);
  bool good = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  good = std::fflush(file) == 0 && good;
  const int error = errno;
  good = std::fclose(file) == 0 && good;
  if (good && in_place) return absl::OkStatus();
  if (!good || std::rename(draft.c_str(), path.c_str()) != 0) {
    const int reason = good ? errno : error;
    if (!in_place) std::remove(draft.c_str());
    return WriteError(path, reason);
  }
  return absl::OkStatus();
}

}  // namespace amhex::client
