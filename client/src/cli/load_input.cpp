#include "cli/load_input.h"

#include <bit>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "amhex/input_hull.h"
#include "cli/load_guidance.h"
#include "formats/draco_encoder.h"
#include "formats/draco_guard.h"
#include "formats/hull_reader.h"
#include "formats/status_macros.h"
#include "formats/volume_reader.h"

namespace amhex::client {
namespace {

static_assert(std::endian::native == std::endian::little, "the arrays are copied as they are");

// The engine makes no more cells than this when the user does not say how many.
constexpr int64_t kMostDefaultCells = 20'000;

template <class T>
void Append(T value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof(T));
}

template <class T>
void AppendArray(const std::vector<T>& values, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
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
  if (const auto* volume = std::get_if<VolumeMesh>(&hull)) {
    return absl::StrCat(volume->cell_faces.size(), " cells, ", volume->vertices.size(),
                        " vertices");
  }
  const auto& cloud = std::get<PointCloud>(hull);
  return absl::StrCat(cloud.points.size(), " points with", cloud.normals.empty() ? "out" : "",
                      " normals");
}

std::string EncodeArrays(const MeshingInput& input) {
  static const TriangleMesh kNoMesh;
  static const PointCloud kNoCloud;
  static const VolumeMesh kNoVolume;
  const auto* mesh = std::get_if<TriangleMesh>(&input.hull);
  const auto* cloud = std::get_if<PointCloud>(&input.hull);
  const auto* volume = std::get_if<VolumeMesh>(&input.hull);
  const auto& points =
      mesh != nullptr ? mesh->vertices : (cloud != nullptr ? cloud->points : volume->vertices);
  const auto& normals = (cloud != nullptr ? *cloud : kNoCloud).normals;
  const auto& triangles = (mesh != nullptr ? *mesh : kNoMesh).triangles;
  const VolumeMesh& cells = volume != nullptr ? *volume : kNoVolume;
  const bool is_extended = volume != nullptr || !input.guidance.empty();
  std::string bytes = "AMHEXHUL";
  Append<int32_t>(is_extended ? 2 : 1, &bytes);
  Append<int32_t>(normals.empty() ? 0 : 1, &bytes);
  std::vector<size_t> counts = {points.size(), triangles.size()};
  if (is_extended) {
    counts.insert(counts.end(),
                  {cells.cell_faces.size(), cells.face_corners.size(), cells.corners.size(),
                   input.guidance.samples.size(), input.guidance.planes.size()});
  }
  for (const size_t count : counts) Append(static_cast<int64_t>(count), &bytes);
  AppendArray(points, &bytes);
  AppendArray(normals, &bytes);
  AppendArray(input.guidance.samples, &bytes);
  AppendArray(input.guidance.planes, &bytes);
  AppendArray(triangles, &bytes);
  AppendArray(cells.cell_faces, &bytes);
  AppendArray(cells.face_corners, &bytes);
  AppendArray(cells.corners, &bytes);
  return bytes;
}

absl::StatusOr<LoadedInput> LoadInput(const std::string& path,
                                      const amhex::v1::SizingParams& sizing, Guidance guidance) {
  LoadedInput input;
  if (HullFormatOfPath(path) == HullFormat::kDraco && guidance.empty()) {
    AMHEX_ASSIGN_OR_RETURN(input, LoadDraco(path));
    input.note.path = path;
    return input;
  }
  MeshingInput read;
  if (VolumeFormatOfPath(path)) {
    AMHEX_ASSIGN_OR_RETURN(read.hull, ReadVolumeFile(path));
  } else {
    AMHEX_ASSIGN_OR_RETURN(read.hull, ReadHullFile(path));
  }
  read.guidance = std::move(guidance);
  input.note.path = path;
  input.note.description = DescribeHull(read.hull);
  if (!read.guidance.empty()) {
    absl::StrAppend(&input.note.description, ", ", DescribeGuidance(read.guidance));
  }
  bool as_arrays = !read.guidance.empty() || std::holds_alternative<VolumeMesh>(read.hull);
  if (as_arrays) {
    input.note.encoding = "plain arrays, 64-bit coordinates";
  } else {
    absl::StatusOr<DracoEncoding> encoding = EncodeDraco(read.hull, Tolerance(read.hull, sizing));
    if (!encoding.ok()) return WithPath(path, encoding.status());
    input.note.encoding = encoding->description;
    as_arrays = encoding->is_double;
    if (!as_arrays) input.encoded.bytes = std::move(encoding->bytes);
  }
  if (as_arrays) {
    input.encoded.encoding = amhex::v1::INPUT_ENCODING_ARRAYS;
    input.encoded.bytes = EncodeArrays(read);
  }
  return input;
}

}  // namespace amhex::client
