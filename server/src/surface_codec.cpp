#include "surface_codec.h"

#include <draco/compression/decode.h>
#include <draco/mesh/mesh.h>

#include <memory>
#include <new>
#include <stdexcept>
#include <utility>

#include "draco_preflight.h"
#include "errors.h"
#include "hull_arrays.h"
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

}  // namespace

absl::StatusOr<MeshingInput> DecodeInput(amhex::v1::InputEncoding encoding,
                                         const std::string& bytes, const Limits& limits) {
  try {
    if (encoding == amhex::v1::INPUT_ENCODING_ARRAYS) return DecodeHullArrays(bytes, limits);
    MeshingInput input;
    AMHEX_ASSIGN_OR_RETURN(input.hull, DecodeDraco(bytes, limits));
    return input;
  } catch (const std::bad_alloc&) {
    return Refuse(amhex::v1::INPUT_DECODE_LIMIT,
                  "decoding the input takes more memory than a worker may have");
  } catch (const std::length_error&) {
    return Refuse(amhex::v1::INPUT_DECODE_LIMIT, "the input announces impossible sizes");
  }
}

}  // namespace amhex::server
