// Draco meshes and point clouds, behind the checks of draco_guard.h.
#include <draco/compression/decode.h>

#include <array>
#include <memory>

#include "absl/strings/str_cat.h"
#include "formats/draco_guard.h"
#include "formats/hull_builder.h"
#include "formats/hull_reader.h"
#include "formats/status_macros.h"

namespace amhex::client {
namespace {

absl::Status DecodeError(const draco::Status& status) {
  const std::string& reason = status.error_msg_string();
  return absl::InvalidArgumentError(
      absl::StrCat("the Draco data are damaged or cut off", reason.empty() ? "" : ": ", reason));
}

// The attribute's value at every point, in double precision.
absl::StatusOr<std::vector<Vec3d>> ReadVectors(const draco::PointCloud& cloud,
                                               const draco::PointAttribute& attribute) {
  if (attribute.num_components() != 3) {
    return absl::InvalidArgumentError(absl::StrCat(
        "a Draco attribute has ", attribute.num_components(), " components instead of 3"));
  }
  std::vector<Vec3d> vectors(cloud.num_points());
  for (draco::PointIndex i(0); i < cloud.num_points(); ++i) {
    std::array<double, 3> value{};
    if (attribute.mapped_index(i).value() >= attribute.size() ||
        !attribute.ConvertValue<double, 3>(attribute.mapped_index(i), value.data())) {
      return absl::InvalidArgumentError(
          absl::StrCat("point ", i.value(), " of the Draco data has no valid value"));
    }
    vectors[i.value()] = {value[0], value[1], value[2]};
  }
  return vectors;
}

absl::StatusOr<std::unique_ptr<draco::PointCloud>> Decode(std::string_view bytes,
                                                          DracoGeometry geometry) {
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::Decoder decoder;
  if (geometry == DracoGeometry::kMesh) {
    auto mesh = decoder.DecodeMeshFromBuffer(&buffer);
    if (!mesh.ok()) return DecodeError(mesh.status());
    return std::unique_ptr<draco::PointCloud>(std::move(mesh).value());
  }
  auto cloud = decoder.DecodePointCloudFromBuffer(&buffer);
  if (!cloud.ok()) return DecodeError(cloud.status());
  return std::unique_ptr<draco::PointCloud>(std::move(cloud).value());
}

}  // namespace

absl::StatusOr<InputHull> ReadDraco(std::string_view bytes) {
  AMHEX_ASSIGN_OR_RETURN(const DracoCounts counts, CheckDracoHeader(bytes));
  AMHEX_ASSIGN_OR_RETURN(const std::unique_ptr<draco::PointCloud> cloud,
                         Decode(bytes, counts.geometry));
  const draco::PointAttribute* positions =
      cloud->GetNamedAttribute(draco::GeometryAttribute::POSITION);
  if (positions == nullptr) return absl::InvalidArgumentError("the Draco data have no positions");
  HullBuilder builder;
  AMHEX_ASSIGN_OR_RETURN(builder.vertices, ReadVectors(*cloud, *positions));
  if (counts.geometry == DracoGeometry::kMesh) {
    const auto& mesh = static_cast<const draco::Mesh&>(*cloud);
    for (draco::FaceIndex f(0); f < mesh.num_faces(); ++f) {
      const draco::Mesh::Face& face = mesh.face(f);
      const std::array<int64_t, 3> corners = {face[0].value(), face[1].value(), face[2].value()};
      AMHEX_RETURN_IF_ERROR(builder.AddPolygon(corners));
    }
  }
  const draco::PointAttribute* normals = cloud->GetNamedAttribute(draco::GeometryAttribute::NORMAL);
  if (normals != nullptr && !builder.has_faces()) {
    AMHEX_ASSIGN_OR_RETURN(builder.normals, ReadVectors(*cloud, *normals));
  }
  return builder.Build();
}

}  // namespace amhex::client
