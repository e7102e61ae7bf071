#include "formats/boundary_surface.h"

#include <span>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "cells/boundary.h"
#include "formats/hull_builder.h"
#include "formats/hull_reader.h"
#include "formats/hull_writer.h"
#include "formats/status_macros.h"

namespace amhex::client {
namespace {

// As for what is sent to the mesher: far below anything the mesh resolves.
constexpr double kTolerancePerEdge = 1.0 / 200;

template <class T>
void AppendNumber(T value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof(T));
}

std::string FormatPlySurface(const PolygonSurface& surface) {
  std::string bytes =
      absl::StrCat("ply\nformat binary_little_endian 1.0\nelement vertex ", surface.vertices.size(),
                   "\nproperty double x\nproperty double y\nproperty double z\nelement face ",
                   surface.faces.size(), "\nproperty list uchar int vertex_indices\nend_header\n");
  for (const Vec3d& v : surface.vertices) {
    for (int axis = 0; axis < 3; ++axis) AppendNumber(v[axis], &bytes);
  }
  for (const Face& face : surface.faces) {
    AppendNumber(static_cast<uint8_t>(face.count), &bytes);
    for (int i = 0; i < face.count; ++i) AppendNumber(face.vertex[i], &bytes);
  }
  return bytes;
}

std::string FormatObjSurface(const PolygonSurface& surface) {
  std::string text;
  for (const Vec3d& v : surface.vertices) {
    absl::StrAppendFormat(&text, "v %.17g %.17g %.17g\n", v.x, v.y, v.z);
  }
  for (const Face& face : surface.faces) {
    text += "f";
    for (int i = 0; i < face.count; ++i) absl::StrAppend(&text, " ", face.vertex[i] + 1);
    text += "\n";
  }
  return text;
}

double MeanEdge(const PolygonSurface& surface) {
  double sum = 0;
  size_t count = 0;
  for (const Face& face : surface.faces) {
    for (int i = 0; i < face.count; ++i, ++count) {
      sum += Norm(surface.vertices[face.vertex[i]] -
                  surface.vertices[face.vertex[(i + 1) % face.count]]);
    }
  }
  return count == 0 ? 0 : sum / static_cast<double>(count);
}

}  // namespace

absl::StatusOr<PolygonSurface> BoundarySurface(const AtMostHexaMesh& mesh) {
  AMHEX_ASSIGN_OR_RETURN(const std::vector<BoundaryFace> boundary, BoundaryOf(mesh, {}));
  constexpr int32_t kUnused = -1, kUsed = 0;
  std::vector<int32_t> number(mesh.vertices.size(), kUnused);
  PolygonSurface surface;
  for (const BoundaryFace& b : boundary) {
    surface.faces.push_back(b.face);
    for (int i = 0; i < b.face.count; ++i) number[b.face.vertex[i]] = kUsed;
  }
  for (size_t v = 0; v < number.size(); ++v) {
    if (number[v] == kUnused) continue;
    number[v] = static_cast<int32_t>(surface.vertices.size());
    surface.vertices.push_back(mesh.vertices[v]);
  }
  for (Face& face : surface.faces) {
    for (int i = 0; i < face.count; ++i) face.vertex[i] = number[face.vertex[i]];
  }
  return surface;
}

TriangleMesh Triangulated(const PolygonSurface& surface) {
  TriangleMesh mesh;
  mesh.vertices = surface.vertices;
  for (const Face& face : surface.faces) {
    TriangulatePolygon(std::span(face.vertex).first(static_cast<size_t>(face.count)), mesh.vertices,
                       &mesh.triangles);
  }
  return mesh;
}

absl::Status WriteBoundarySurface(const AtMostHexaMesh& mesh, const std::string& path) {
  AMHEX_ASSIGN_OR_RETURN(const PolygonSurface surface, BoundarySurface(mesh));
  switch (HullFormatOfPath(path).value_or(HullFormat::kStl)) {
    case HullFormat::kPly:
      return WriteWholeFile(path, FormatPlySurface(surface));
    case HullFormat::kObj:
      return WriteWholeFile(path, FormatObjSurface(surface));
    case HullFormat::kOff:
    case HullFormat::kStl:
    case HullFormat::kDraco:
    case HullFormat::kXyz:
      break;
  }
  return WriteHullFile(Triangulated(surface), path, kTolerancePerEdge * MeanEdge(surface));
}

}  // namespace amhex::client
