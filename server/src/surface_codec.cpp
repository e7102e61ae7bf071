#include "surface_codec.h"

#include <draco/compression/decode.h>
#include <draco/mesh/mesh.h>

#include <cstring>
#include <memory>
#include <new>
#include <utility>

#include "errors.h"
#include "input_preflight.h"
#include "status_macros.h"

namespace amhex::server {
namespace {

absl::Status Refuse(amhex::v1::ErrorReason reason, const std::string& message) {
  return MakeError(absl::StatusCode::kInvalidArgument, reason, message);
}

// The values of a three-component attribute, one per entry.
absl::StatusOr<std::vector<Vec3d>> AttributeValues(const draco::PointAttribute& attribute,
                                                   const char* what) {
  if (attribute.num_components() != 3) {
    return Refuse(amhex::v1::INPUT_MALFORMED,
                  std::string("the input's ") + what + " attribute has " +
                      std::to_string(attribute.num_components()) + " components, not 3");
  }
  std::vector<Vec3d> values(attribute.size());
  for (draco::AttributeValueIndex i(0); i < static_cast<uint32_t>(attribute.size()); ++i) {
    double xyz[3];
    if (!attribute.ConvertValue<double, 3>(i, xyz)) {
      return Refuse(amhex::v1::INPUT_MALFORMED,
                    std::string("the input's ") + what + " attribute cannot be read");
    }
    values[i.value()] = {xyz[0], xyz[1], xyz[2]};
  }
  return values;
}

// The index of a point's value, checked: the map comes from the file.
absl::StatusOr<int32_t> MappedIndex(const draco::PointAttribute& attribute, uint32_t point) {
  const uint32_t index = attribute.mapped_index(draco::PointIndex(point)).value();
  if (index >= attribute.size()) {
    return Refuse(amhex::v1::INPUT_MALFORMED, "the input refers to a value it does not hold");
  }
  return static_cast<int32_t>(index);
}

// Points that differ only in other attributes share their position, and so their vertex.
absl::StatusOr<InputHull> ToTriangles(const draco::Mesh& mesh,
                                      const draco::PointAttribute& position) {
  TriangleMesh out;
  AMHEX_ASSIGN_OR_RETURN(out.vertices, AttributeValues(position, "position"));
  out.triangles.resize(mesh.num_faces());
  for (uint32_t face = 0; face < mesh.num_faces(); ++face) {
    const draco::Mesh::Face& corners = mesh.face(draco::FaceIndex(face));
    for (size_t corner = 0; corner < 3; ++corner) {
      const uint32_t point = corners[corner].value();
      if (point >= mesh.num_points()) {
        return Refuse(amhex::v1::INPUT_INVALID, "triangle " + std::to_string(face) +
                                                    " refers to point " + std::to_string(point) +
                                                    " of " + std::to_string(mesh.num_points()));
      }
      AMHEX_ASSIGN_OR_RETURN(out.triangles[face][corner], MappedIndex(position, point));
    }
  }
  return InputHull(std::move(out));
}

absl::StatusOr<InputHull> ToCloud(const draco::PointCloud& cloud,
                                  const draco::PointAttribute& position) {
  PointCloud out;
  AMHEX_ASSIGN_OR_RETURN(const auto points, AttributeValues(position, "position"));
  out.points.resize(cloud.num_points());
  for (uint32_t i = 0; i < cloud.num_points(); ++i) {
    AMHEX_ASSIGN_OR_RETURN(const int32_t index, MappedIndex(position, i));
    out.points[i] = points[static_cast<size_t>(index)];
  }
  const draco::PointAttribute* normal = cloud.GetNamedAttribute(draco::GeometryAttribute::NORMAL);
  if (normal == nullptr) return InputHull(std::move(out));
  AMHEX_ASSIGN_OR_RETURN(const auto normals, AttributeValues(*normal, "normal"));
  out.normals.resize(cloud.num_points());
  for (uint32_t i = 0; i < cloud.num_points(); ++i) {
    AMHEX_ASSIGN_OR_RETURN(const int32_t index, MappedIndex(*normal, i));
    out.normals[i] = normals[static_cast<size_t>(index)];
  }
  return InputHull(std::move(out));
}

absl::StatusOr<InputHull> DecodeDraco(const std::string& bytes, const Limits& limits) {
  AMHEX_ASSIGN_OR_RETURN(const DracoHeader header,
                         PreflightDraco({reinterpret_cast<const uint8_t*>(bytes.data()),
                                         bytes.size(), static_cast<int64_t>(bytes.size())},
                                        limits));
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodePointCloudFromBuffer(&buffer);
  if (!decoded.ok()) {
    return Refuse(amhex::v1::INPUT_MALFORMED,
                  "the Draco input is damaged: " + decoded.status().error_msg_string());
  }
  const std::unique_ptr<draco::PointCloud> cloud = std::move(decoded).value();
  const draco::PointAttribute* position =
      cloud->GetNamedAttribute(draco::GeometryAttribute::POSITION);
  if (position == nullptr || cloud->num_points() == 0) {
    return Refuse(amhex::v1::INPUT_EMPTY, "the input has no positions");
  }
  if (cloud->num_attributes() > limits.max_attribute_count) {
    return Refuse(amhex::v1::INPUT_TOO_LARGE,
                  "the input has " + std::to_string(cloud->num_attributes()) +
                      " attributes; the limit is " + std::to_string(limits.max_attribute_count));
  }
  if (!header.is_mesh) return ToCloud(*cloud, *position);
  const auto& mesh = static_cast<const draco::Mesh&>(*cloud);
  if (mesh.num_faces() == 0) {
    return Refuse(amhex::v1::INPUT_EMPTY, "the input is a mesh without triangles");
  }
  return ToTriangles(mesh, *position);
}

// Copies `count` elements from `*offset` on and moves it behind them.
template <class T>
std::vector<T> TakeArray(const std::string& bytes, int64_t count, size_t* offset) {
  std::vector<T> values(static_cast<size_t>(count));
  if (count > 0) std::memcpy(values.data(), bytes.data() + *offset, values.size() * sizeof(T));
  *offset += values.size() * sizeof(T);
  return values;
}

template <class T>
void AppendArray(const std::vector<T>& values, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

template <class T>
void AppendValue(T value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof(T));
}

absl::StatusOr<InputHull> DecodeArrays(const std::string& bytes, const Limits& limits) {
  AMHEX_ASSIGN_OR_RETURN(const HullArraysHeader header,
                         PreflightHullArrays({reinterpret_cast<const uint8_t*>(bytes.data()),
                                              bytes.size(), static_cast<int64_t>(bytes.size())},
                                             limits));
  size_t offset = kArraysHeaderBytes;
  auto points = TakeArray<Vec3d>(bytes, header.point_count, &offset);
  if (header.triangle_count == 0) {
    auto normals = TakeArray<Vec3d>(bytes, header.has_normals ? header.point_count : 0, &offset);
    return InputHull(PointCloud{std::move(points), std::move(normals)});
  }
  auto triangles = TakeArray<std::array<int32_t, 3>>(bytes, header.triangle_count, &offset);
  for (size_t i = 0; i < triangles.size(); ++i) {
    for (const int32_t point : triangles[i]) {
      if (point >= 0 && point < header.point_count) continue;
      return Refuse(amhex::v1::INPUT_INVALID, "triangle " + std::to_string(i) +
                                                  " refers to point " + std::to_string(point) +
                                                  " of " + std::to_string(header.point_count));
    }
  }
  return InputHull(TriangleMesh{std::move(points), std::move(triangles)});
}

}  // namespace

absl::StatusOr<InputHull> DecodeSurface(amhex::v1::InputEncoding encoding, const std::string& bytes,
                                        const Limits& limits) {
  try {
    if (encoding == amhex::v1::INPUT_ENCODING_ARRAYS) return DecodeArrays(bytes, limits);
    return DecodeDraco(bytes, limits);
  } catch (const std::bad_alloc&) {
    return Refuse(amhex::v1::INPUT_DECODE_LIMIT,
                  "decoding the input takes more memory than a worker may have");
  } catch (const std::length_error&) {
    return Refuse(amhex::v1::INPUT_DECODE_LIMIT, "the input announces impossible sizes");
  }
}

std::string EncodeHullArrays(const InputHull& hull) {
  const auto* mesh = std::get_if<TriangleMesh>(&hull);
  const auto* cloud = std::get_if<PointCloud>(&hull);
  const auto& points = mesh != nullptr ? mesh->vertices : cloud->points;
  const bool has_normals = cloud != nullptr && !cloud->normals.empty();
  std::string bytes(kHullArraysMagic, kArraysMagicBytes);
  AppendValue(kArraysVersion, &bytes);
  AppendValue(int32_t{has_normals ? 1 : 0}, &bytes);
  AppendValue(static_cast<int64_t>(points.size()), &bytes);
  AppendValue(static_cast<int64_t>(mesh != nullptr ? mesh->triangles.size() : 0), &bytes);
  AppendArray(points, &bytes);
  if (has_normals) AppendArray(cloud->normals, &bytes);
  if (mesh != nullptr) AppendArray(mesh->triangles, &bytes);
  return bytes;
}

}  // namespace amhex::server
