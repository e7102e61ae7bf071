#include "formats/draco_encoder.h"

#include <draco/compression/encode.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "formats/hull_builder.h"
#include "formats/status_macros.h"

namespace amhex::client {
namespace {

constexpr int kFewestPositionBits = 8;
constexpr int kMostPositionBits = 30;  // Draco's limit
constexpr int kNormalBits = 12;
// Half a unit in the last place of 32-bit floating point, relative.
constexpr double kFloatRounding = 1.0 / (1 << 24);
// Roundings to 32 bits on the way: the input, and twice when Draco scales and shifts back.
constexpr double kQuantizedRoundings = 3;
const double kDiagonal = std::sqrt(3.0);  // from one axis to the distance

const std::vector<Vec3d>& PositionsOf(const InputHull& hull) {
  if (const auto* mesh = std::get_if<TriangleMesh>(&hull)) return mesh->vertices;
  return std::get<PointCloud>(hull).points;
}

double LargestMagnitude(const Box3d& box) {
  double largest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    largest = std::max({largest, std::abs(box.low[axis]), std::abs(box.high[axis])});
  }
  return largest;
}

bool FitsFloatExactly(const std::vector<Vec3d>& positions) {
  const auto fits = [](double v) { return static_cast<double>(static_cast<float>(v)) == v; };
  return std::all_of(positions.begin(), positions.end(),
                     [&](const Vec3d& p) { return fits(p.x) && fits(p.y) && fits(p.z); });
}

// Draco spreads 2^bits - 1 steps over the longest side of the box.
double QuantizationError(const Box3d& box, int bits) {
  const Vec3d extent = box.Extent();
  const double range = std::max({extent.x, extent.y, extent.z});
  const double step = range / (std::ldexp(1.0, bits) - 1);
  return kDiagonal * (step / 2 + kQuantizedRoundings * kFloatRounding * LargestMagnitude(box));
}

void ChooseForm(const std::vector<Vec3d>& positions, const Box3d& box, double tolerance,
                DracoEncoding* encoding) {
  for (int bits = kFewestPositionBits; bits <= kMostPositionBits && tolerance > 0; ++bits) {
    const double error = QuantizationError(box, bits);
    if (error > tolerance) continue;
    encoding->quantization_bits = bits;
    encoding->max_error = error;
    encoding->description =
        absl::StrFormat("positions quantised to %d bits, error at most %.3g", bits, error);
    return;
  }
  const double float_error =
      FitsFloatExactly(positions) ? 0 : kDiagonal * kFloatRounding * LargestMagnitude(box);
  if (float_error <= tolerance) {
    encoding->max_error = float_error;
    encoding->description =
        float_error == 0
            ? "positions as 32-bit numbers, without error"
            : absl::StrFormat("positions as 32-bit numbers, error at most %.3g", float_error);
    return;
  }
  encoding->is_double = true;
  encoding->description =
      "positions as 64-bit numbers, without error, as 32 bits are too coarse for cells this small "
      "so far from the origin";
}

template <class T>
void AddAttribute(draco::GeometryAttribute::Type type, draco::DataType data_type,
                  const std::vector<Vec3d>& values, draco::PointCloud* cloud) {
  draco::GeometryAttribute attribute;
  attribute.Init(type, nullptr, 3, data_type, false, 3 * sizeof(T), 0);
  const int id = cloud->AddAttribute(attribute, true, static_cast<uint32_t>(values.size()));
  for (uint32_t i = 0; i < values.size(); ++i) {
    const std::array<T, 3> value = {static_cast<T>(values[i].x), static_cast<T>(values[i].y),
                                    static_cast<T>(values[i].z)};
    cloud->attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), value.data());
  }
}

void FillCloud(const InputHull& hull, bool is_double, draco::PointCloud* cloud) {
  const std::vector<Vec3d>& positions = PositionsOf(hull);
  cloud->set_num_points(static_cast<uint32_t>(positions.size()));
  if (is_double) {
    AddAttribute<double>(draco::GeometryAttribute::POSITION, draco::DT_FLOAT64, positions, cloud);
  } else {
    AddAttribute<float>(draco::GeometryAttribute::POSITION, draco::DT_FLOAT32, positions, cloud);
  }
  const auto* points = std::get_if<PointCloud>(&hull);
  if (points != nullptr && !points->normals.empty()) {
    std::vector<Vec3d> normals = points->normals;
    for (Vec3d& normal : normals) normal = Normalized(normal);
    AddAttribute<float>(draco::GeometryAttribute::NORMAL, draco::DT_FLOAT32, normals, cloud);
  }
}

absl::Status EncodeMesh(const InputHull& hull, bool is_double, draco::Encoder* encoder,
                        draco::EncoderBuffer* buffer) {
  const auto& triangles = std::get<TriangleMesh>(hull).triangles;
  draco::Mesh mesh;
  FillCloud(hull, is_double, &mesh);
  mesh.SetNumFaces(triangles.size());
  for (uint32_t f = 0; f < triangles.size(); ++f) {
    draco::Mesh::Face face;
    for (int corner = 0; corner < 3; ++corner) {
      face[corner] = draco::PointIndex(static_cast<uint32_t>(triangles[f][corner]));
    }
    mesh.SetFace(draco::FaceIndex(f), face);
  }
  if (!is_double && encoder->EncodeMeshToBuffer(mesh, buffer).ok()) return absl::OkStatus();
  // The compact connectivity has no word for some non-manifold surfaces, nor for 64-bit
  // positions; the plain one has.
  buffer->Clear();
  encoder->SetEncodingMethod(draco::MESH_SEQUENTIAL_ENCODING);
  const draco::Status plain = encoder->EncodeMeshToBuffer(mesh, buffer);
  if (plain.ok()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("Draco cannot encode the surface: ", plain.error_msg_string()));
}

absl::Status EncodeCloud(const InputHull& hull, bool is_double, bool is_quantized,
                         draco::Encoder* encoder, draco::EncoderBuffer* buffer) {
  draco::PointCloud cloud;
  FillCloud(hull, is_double, &cloud);
  encoder->SetEncodingMethod(is_quantized ? draco::POINT_CLOUD_KD_TREE_ENCODING
                                          : draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
  const draco::Status status = encoder->EncodePointCloudToBuffer(cloud, buffer);
  if (status.ok()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("Draco cannot encode the cloud: ", status.error_msg_string()));
}

double SignedVolume(const TriangleMesh& mesh) {
  const Vec3d origin = mesh.vertices.front();
  double six_volumes = 0;
  for (const auto& t : mesh.triangles) {
    six_volumes += Determinant(mesh.vertices[t[0]] - origin, mesh.vertices[t[1]] - origin,
                               mesh.vertices[t[2]] - origin);
  }
  return six_volumes / 6;
}

// Of the box of the points without a share of them at either end of each axis: a few stray points
// of a scan would make the whole box any size.
Vec3d InnerExtent(const std::vector<Vec3d>& points) {
  constexpr double kShareAtEnds = 0.05;
  const auto share = static_cast<std::ptrdiff_t>(kShareAtEnds * static_cast<double>(points.size()));
  Vec3d extent;
  std::vector<double> along(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(points.begin(), points.end(), along.begin(),
                   [axis](const Vec3d& p) { return p[axis]; });
    const auto first = along.begin() + share, last = along.end() - 1 - share;
    std::nth_element(along.begin(), first, along.end());
    const double low = *first;
    std::nth_element(along.begin(), last, along.end());
    extent[axis] = *last - low;
  }
  return extent;
}

}  // namespace

Box3d BoxOf(const InputHull& hull) {
  Box3d box;
  for (const Vec3d& p : PositionsOf(hull)) box.Extend(p);
  return box;
}

double EstimatedEdgeLength(const InputHull& hull, int64_t cell_count) {
  // Share of its box that a part fills at least; only thin shells fill less, and for those the
  // estimate merely costs a bit or two.
  constexpr double kLeastFill = 0.02;
  const Box3d box = BoxOf(hull);
  if (box.IsEmpty() || cell_count <= 0) return 0;
  const auto* mesh = std::get_if<TriangleMesh>(&hull);
  const Vec3d extent = mesh != nullptr ? box.Extent() : InnerExtent(PositionsOf(hull));
  double volume = kLeastFill * extent.x * extent.y * extent.z;
  if (mesh != nullptr) volume = std::max(volume, std::abs(SignedVolume(*mesh)));
  return std::cbrt(volume / static_cast<double>(cell_count));
}

absl::StatusOr<DracoEncoding> EncodeDraco(const InputHull& hull, double tolerance) {
  const std::vector<Vec3d>& positions = PositionsOf(hull);
  if (positions.empty()) return absl::InvalidArgumentError("there is nothing to encode");
  AMHEX_RETURN_IF_ERROR(CheckFinite(positions, "vertex"));
  DracoEncoding encoding;
  ChooseForm(positions, BoxOf(hull), tolerance, &encoding);
  draco::Encoder encoder;
  constexpr int kEncodingSpeed = 3;  // 0 = smallest, 10 = fastest
  encoder.SetSpeedOptions(kEncodingSpeed, kEncodingSpeed);
  const bool is_quantized = encoding.quantization_bits > 0;
  if (is_quantized) {
    encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION,
                                     encoding.quantization_bits);
    encoder.SetAttributeQuantization(draco::GeometryAttribute::NORMAL, kNormalBits);
  }
  draco::EncoderBuffer buffer;
  if (std::holds_alternative<TriangleMesh>(hull)) {
    AMHEX_RETURN_IF_ERROR(EncodeMesh(hull, encoding.is_double, &encoder, &buffer));
  } else {
    AMHEX_RETURN_IF_ERROR(EncodeCloud(hull, encoding.is_double, is_quantized, &encoder, &buffer));
  }
  encoding.bytes.assign(buffer.data(), buffer.size());
  return encoding;
}

}  // namespace amhex::client
