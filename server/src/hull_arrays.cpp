#include "hull_arrays.h"

#include <array>
#include <cstring>
#include <utility>
#include <vector>

#include "errors.h"
#include "input_preflight.h"
#include "status_macros.h"

namespace amhex::server {
namespace {

// Samples and planes travel as the structs lie in memory.
static_assert(sizeof(GuideSample) == 9 * sizeof(double));
static_assert(sizeof(GuidePlane) == 6 * sizeof(double));

// Takes array after array from the bytes behind the header.
class ArrayReader {
 public:
  ArrayReader(const std::string& bytes, int header_bytes)
      : bytes_(bytes), offset_(static_cast<size_t>(header_bytes)) {}

  template <class T>
  std::vector<T> Take(int64_t count) {
    std::vector<T> values(static_cast<size_t>(count));
    if (count > 0) std::memcpy(values.data(), bytes_.data() + offset_, values.size() * sizeof(T));
    offset_ += values.size() * sizeof(T);
    return values;
  }

 private:
  const std::string& bytes_;
  size_t offset_;
};

template <class T>
void AppendArray(const std::vector<T>& values, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

template <class T>
void AppendValue(T value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof(T));
}

absl::Status CheckTriangles(const TriangleMesh& mesh) {
  const auto point_count = static_cast<int64_t>(mesh.vertices.size());
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const int32_t point : mesh.triangles[i]) {
      if (point >= 0 && point < point_count) continue;
      return MakeError(absl::StatusCode::kInvalidArgument, amhex::v1::INPUT_INVALID,
                       "triangle " + std::to_string(i) + " refers to point " +
                           std::to_string(point) + " of " + std::to_string(point_count));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<MeshingInput> DecodeHullArrays(const std::string& bytes, const Limits& limits) {
  AMHEX_ASSIGN_OR_RETURN(const HullArraysHeader header,
                         PreflightHullArrays({reinterpret_cast<const uint8_t*>(bytes.data()),
                                              bytes.size(), static_cast<int64_t>(bytes.size())},
                                             limits));
  ArrayReader reader(bytes, header.header_bytes);
  MeshingInput input;
  auto points = reader.Take<Vec3d>(header.point_count);
  auto normals = reader.Take<Vec3d>(header.has_normals ? header.point_count : 0);
  input.guidance.samples = reader.Take<GuideSample>(header.guide_sample_count);
  input.guidance.planes = reader.Take<GuidePlane>(header.guide_plane_count);
  if (header.triangle_count > 0) {
    TriangleMesh mesh{std::move(points),
                      reader.Take<std::array<int32_t, 3>>(header.triangle_count)};
    AMHEX_RETURN_IF_ERROR(CheckTriangles(mesh));
    input.hull = std::move(mesh);
  } else if (header.cell_count > 0) {
    VolumeMesh mesh;
    mesh.vertices = std::move(points);
    mesh.cell_faces = reader.Take<int32_t>(header.cell_count);
    mesh.face_corners = reader.Take<int32_t>(header.face_count);
    mesh.corners = reader.Take<int32_t>(header.corner_count);
    input.hull = std::move(mesh);
  } else {
    input.hull = PointCloud{std::move(points), std::move(normals)};
  }
  return input;
}

std::string EncodeHullArrays(const MeshingInput& input) {
  const auto* mesh = std::get_if<TriangleMesh>(&input.hull);
  const auto* cloud = std::get_if<PointCloud>(&input.hull);
  const auto* volume = std::get_if<VolumeMesh>(&input.hull);
  const std::vector<Vec3d>& points =
      mesh != nullptr ? mesh->vertices : (cloud != nullptr ? cloud->points : volume->vertices);
  const bool has_normals = cloud != nullptr && !cloud->normals.empty();
  const bool is_extended = volume != nullptr || !input.guidance.empty();
  const auto append_count = [](size_t count, std::string* bytes) {
    AppendValue(static_cast<int64_t>(count), bytes);
  };
  std::string bytes(kHullArraysMagic, kArraysMagicBytes);
  AppendValue(is_extended ? kExtendedArraysVersion : kArraysVersion, &bytes);
  AppendValue(int32_t{has_normals ? 1 : 0}, &bytes);
  append_count(points.size(), &bytes);
  append_count(mesh != nullptr ? mesh->triangles.size() : 0, &bytes);
  if (is_extended) {
    append_count(volume != nullptr ? volume->cell_faces.size() : 0, &bytes);
    append_count(volume != nullptr ? volume->face_corners.size() : 0, &bytes);
    append_count(volume != nullptr ? volume->corners.size() : 0, &bytes);
    append_count(input.guidance.samples.size(), &bytes);
    append_count(input.guidance.planes.size(), &bytes);
  }
  AppendArray(points, &bytes);
  if (has_normals) AppendArray(cloud->normals, &bytes);
  AppendArray(input.guidance.samples, &bytes);
  AppendArray(input.guidance.planes, &bytes);
  if (mesh != nullptr) AppendArray(mesh->triangles, &bytes);
  if (volume != nullptr) {
    AppendArray(volume->cell_faces, &bytes);
    AppendArray(volume->face_corners, &bytes);
    AppendArray(volume->corners, &bytes);
  }
  return bytes;
}

}  // namespace amhex::server
