#include "cli/load_input.h"

#include <bit>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "amhex/input_hull.h"
#include "formats/draco_encoder.h"
#include "formats/draco_guard.h"
#include "formats/hull_reader.h"
#include "formats/status_macros.h"

namespace amhex::client {
namespace {

static_assert(std::endian::native == std::endian::little, "the arrays are copied as they are");

// The engine makes no more cells than this when the user does not say how many.
constexpr int64_t kMostDefaultCells = 20'000;

template <class T>
void Append(T value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof(T));
}

void AppendVectors(const std::vector<Vec3d>& vectors, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(vectors.data()), vectors.size() * sizeof(Vec3d));
}

absl::Status WithPath(const std::string& path, const absl::Status& status) {
  return absl::Status(status.code(), absl::StrCat(path, ": ", std::string(status.message())));
}

absl::StatusOr<LoadedInput> LoadDraco(const std::string& path) {
  LoadedInput input;
  AMHEX_ASSIGN_OR_RETURN(input.encoded.bytes, ReadWholeFile(path));
  if (input.encoded.bytes.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": the file is empty"));
  }
  const absl::StatusOr<DracoCounts> counts = CheckDracoHeader(input.encoded.bytes);
  if (!counts.ok()) return WithPath(path, counts.status());
  input.note.description = counts->geometry == DracoGeometry::kMesh
                               ? absl::StrCat(counts->face_count, " triangles")
                               : absl::StrCat(counts->point_count, " points");
  input.note.encoding = "Draco, as it is in the file";
  return input;
}

double Tolerance(const InputHull& hull, const amhex::v1::SizingParams& sizing) {
  const double edge_length =
      sizing.edge_length() > 0
          ? sizing.edge_length()
          : EstimatedEdgeLength(hull,
                                sizing.cell_count() > 0 ? sizing.cell_count() : kMostDefaultCells);
  return kPositionErrorPerCell * edge_length;
}

}  // namespace

std::string DescribeHull(const InputHull& hull) {
  if (const auto* mesh = std::get_if<TriangleMesh>(&hull)) {
    return absl::StrCat(mesh->triangles.size(), " triangles, ", mesh->vertices.size(), " vertices");
  }
  const auto& cloud = std::get<PointCloud>(hull);
  return absl::StrCat(cloud.points.size(), " points with", cloud.normals.empty() ? "out" : "",
                      " normals");
}

std::string EncodeArrays(const InputHull& hull) {
  static const std::vector<Vec3d> kNoNormals;
  static const std::vector<std::array<int32_t, 3>> kNoTriangles;
  constexpr int32_t kVersion = 1;
  const auto* mesh = std::get_if<TriangleMesh>(&hull);
  const auto* cloud = std::get_if<PointCloud>(&hull);
  const auto& points = mesh != nullptr ? mesh->vertices : cloud->points;
  const auto& normals = cloud != nullptr ? cloud->normals : kNoNormals;
  const auto& triangles = mesh != nullptr ? mesh->triangles : kNoTriangles;
  std::string bytes = "AMHEXHUL";
  Append(kVersion, &bytes);
  Append<int32_t>(normals.empty() ? 0 : 1, &bytes);
  Append(static_cast<int64_t>(points.size()), &bytes);
  Append(static_cast<int64_t>(triangles.size()), &bytes);
  AppendVectors(points, &bytes);
  AppendVectors(normals, &bytes);
  bytes.append(reinterpret_cast<const char*>(triangles.data()),
               triangles.size() * sizeof(triangles[0]));
  return bytes;
}

absl::StatusOr<LoadedInput> LoadInput(const std::string& path,
                                      const amhex::v1::SizingParams& sizing) {
  LoadedInput input;
  if (HullFormatOfPath(path) == HullFormat::kDraco) {
    AMHEX_ASSIGN_OR_RETURN(input, LoadDraco(path));
  } else {
    AMHEX_ASSIGN_OR_RETURN(const InputHull hull, ReadHullFile(path));
    input.note.description = DescribeHull(hull);
    absl::StatusOr<DracoEncoding> encoding = EncodeDraco(hull, Tolerance(hull, sizing));
    if (!encoding.ok()) return WithPath(path, encoding.status());
    input.note.encoding = encoding->description;
    if (encoding->is_double) {
      input.encoded.encoding = amhex::v1::INPUT_ENCODING_ARRAYS;
      input.encoded.bytes = EncodeArrays(hull);
    } else {
      input.encoded.bytes = std::move(encoding->bytes);
    }
  }
  input.note.path = path;
  return input;
}

}  // namespace amhex::client
