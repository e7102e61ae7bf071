#include "input/hull_checks.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "input/offenders.h"
#include "input/volume_checks.h"

namespace amhex {
namespace {

// Squares and cubes of coordinates stay finite and normal below this.
constexpr double kLargestCoordinate = 1e90;
// Half-edges are numbered 3 * triangle + corner in 32 bits.
constexpr size_t kMostElements = std::numeric_limits<int32_t>::max() / 4;
// Fraction of the box diagonal below which an extent is rounding noise.
constexpr double kFlatness = 1e-9;

std::string Show(const Vec3d& p) { return absl::StrCat("(", p.x, ", ", p.y, ", ", p.z, ")"); }

bool IsUsable(const Vec3d& p) {
  // Written so that not-a-number fails.
  return std::abs(p.x) <= kLargestCoordinate && std::abs(p.y) <= kLargestCoordinate &&
         std::abs(p.z) <= kLargestCoordinate;
}

absl::Status CheckCoordinates(const std::vector<Vec3d>& points, const char* what) {
  Offenders offenders;
  for (size_t i = 0; i < points.size(); ++i) {
    if (!IsUsable(points[i])) offenders.Add(i);
  }
  if (!offenders.Any()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(offenders.Describe(what), " is ", Show(points[offenders.first()]),
                   ": coordinates must be finite and at most ", kLargestCoordinate, " in size"));
}

absl::Status CheckIndices(const TriangleMesh& mesh) {
  const auto vertex_count = static_cast<int64_t>(mesh.vertices.size());
  Offenders offenders;
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const int32_t v : mesh.triangles[i]) {
      if (v >= 0 && v < vertex_count) continue;
      offenders.Add(i);
      break;
    }
  }
  if (!offenders.Any()) return absl::OkStatus();
  const auto& t = mesh.triangles[offenders.first()];
  return absl::InvalidArgumentError(absl::StrCat(offenders.Describe("triangle"), " has corners ",
                                                 t[0], ", ", t[1], ", ", t[2],
                                                 ": indices must be in [0, ", vertex_count, ")"));
}

// The point farthest from what `distance` measures.
template <class Distance>
Vec3d Farthest(const std::vector<Vec3d>& points, const Distance& distance) {
  Vec3d best = points[0];
  double largest = -1;
  for (const Vec3d& p : points) {
    const double d = distance(p);
    if (d > largest) largest = d, best = p;
  }
  return best;
}

absl::Status CheckSpansSpace(const std::vector<Vec3d>& points, const char* what) {
  if (points.size() < 4) {
    return absl::InvalidArgumentError(absl::StrCat("the input has ", points.size(), " ", what,
                                                   ": at least 4 that span space are needed"));
  }
  const Vec3d a = points[0];
  const Vec3d b = Farthest(points, [&](const Vec3d& p) { return Norm(p - a); });
  const double size = Norm(b - a);
  const Vec3d along = Normalized(b - a);
  const auto from_line = [&](const Vec3d& p) { return Norm(Cross(along, p - a)); };
  const Vec3d c = Farthest(points, from_line);
  const Vec3d normal = Normalized(Cross(along, c - a));
  const auto from_plane = [&](const Vec3d& p) { return std::abs(Dot(normal, p - a)); };
  const Vec3d d = Farthest(points, from_plane);
  const char* shape = nullptr;
  if (!(size > 0)) {
    shape = "at one point";
  } else if (from_line(c) <= kFlatness * size) {
    shape = "on one line";
  } else if (from_plane(d) <= kFlatness * size) {
    shape = "in one plane";
  }
  if (shape == nullptr) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("all ", points.size(), " ", what, " lie ", shape, ": they enclose no volume"));
}

absl::Status CheckCount(size_t count, const char* what) {
  if (count <= kMostElements) return absl::OkStatus();
  return absl::OutOfRangeError(
      absl::StrCat("the input has ", count, " ", what, ", the limit is ", kMostElements));
}

absl::Status CheckMesh(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) {
    return absl::InvalidArgumentError("the input mesh has no triangles");
  }
  AMHEX_RETURN_IF_ERROR(CheckCount(mesh.vertices.size(), "vertices"));
  AMHEX_RETURN_IF_ERROR(CheckCount(mesh.triangles.size(), "triangles"));
  AMHEX_RETURN_IF_ERROR(CheckCoordinates(mesh.vertices, "vertex"));
  AMHEX_RETURN_IF_ERROR(CheckIndices(mesh));
  return CheckSpansSpace(mesh.vertices, "vertices");
}

absl::Status CheckCloud(const PointCloud& cloud) {
  if (cloud.points.empty()) return absl::InvalidArgumentError("the input cloud has no points");
  AMHEX_RETURN_IF_ERROR(CheckCount(cloud.points.size(), "points"));
  if (!cloud.normals.empty() && cloud.normals.size() != cloud.points.size()) {
    return absl::InvalidArgumentError(absl::StrCat("the input cloud has ", cloud.points.size(),
                                                   " points and ", cloud.normals.size(),
                                                   " normals: either as many or none"));
  }
  AMHEX_RETURN_IF_ERROR(CheckCoordinates(cloud.points, "point"));
  AMHEX_RETURN_IF_ERROR(CheckCoordinates(cloud.normals, "normal"));
  return CheckSpansSpace(cloud.points, "points");
}

absl::Status CheckVolume(const VolumeMesh& mesh) {
  AMHEX_RETURN_IF_ERROR(CheckVolumeLists(mesh));
  AMHEX_RETURN_IF_ERROR(CheckCoordinates(mesh.vertices, "vertex"));
  return CheckSpansSpace(mesh.vertices, "vertices");
}

}  // namespace

absl::Status CheckInput(const InputHull& input) {
  if (const auto* mesh = std::get_if<TriangleMesh>(&input)) return CheckMesh(*mesh);
  if (const auto* volume = std::get_if<VolumeMesh>(&input)) return CheckVolume(*volume);
  return CheckCloud(std::get<PointCloud>(input));
}

}  // namespace amhex
