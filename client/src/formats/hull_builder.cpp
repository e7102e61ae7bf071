#include "formats/hull_builder.h"

#include <cmath>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "formats/status_macros.h"

namespace amhex::client {
namespace {

using Triangle = std::array<int32_t, 3>;

// Normal of a polygon by Newell's sum; its length is twice the area.
Vec3d PolygonNormal(std::span<const int32_t> corners, const std::vector<Vec3d>& vertices) {
  Vec3d sum;
  const Vec3d origin = vertices[corners[0]];
  for (size_t i = 0; i < corners.size(); ++i) {
    const Vec3d a = vertices[corners[i]] - origin;
    const Vec3d b = vertices[corners[(i + 1) % corners.size()]] - origin;
    sum += Cross(a, b);
  }
  return sum;
}

Vec3d TriangleNormal(const Triangle& t, const std::vector<Vec3d>& vertices) {
  return Cross(vertices[t[1]] - vertices[t[0]], vertices[t[2]] - vertices[t[0]]);
}

// Cosine of the bend between two triangles; -2 when one of them is degenerate or turned around.
double Flatness(const Triangle& a, const Triangle& b, const Vec3d& normal,
                const std::vector<Vec3d>& vertices) {
  const Vec3d na = TriangleNormal(a, vertices), nb = TriangleNormal(b, vertices);
  if (Dot(na, normal) <= 0 || Dot(nb, normal) <= 0) return -2;
  return Dot(Normalized(na), Normalized(nb));
}

void SplitQuad(std::span<const int32_t> q, const std::vector<Vec3d>& vertices,
               std::vector<Triangle>* triangles) {
  const Vec3d normal = PolygonNormal(q, vertices);
  const Triangle a0{q[0], q[1], q[2]}, a1{q[0], q[2], q[3]};
  const Triangle b0{q[0], q[1], q[3]}, b1{q[1], q[2], q[3]};
  const double flat_a = Flatness(a0, a1, normal, vertices);
  const double flat_b = Flatness(b0, b1, normal, vertices);
  const double length_a = SquaredNorm(vertices[q[2]] - vertices[q[0]]);
  const double length_b = SquaredNorm(vertices[q[3]] - vertices[q[1]]);
  constexpr double kSameFlatness = 1e-9;
  const bool take_a =
      std::abs(flat_a - flat_b) < kSameFlatness ? length_a <= length_b : flat_a > flat_b;
  triangles->push_back(take_a ? a0 : b0);
  triangles->push_back(take_a ? a1 : b1);
}

// True if `p` lies in or on triangle abc, all seen along `normal`.
bool Covers(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& p, const Vec3d& normal) {
  return Dot(Cross(b - a, p - a), normal) >= 0 && Dot(Cross(c - b, p - b), normal) >= 0 &&
         Dot(Cross(a - c, p - c), normal) >= 0;
}

// True if the corner at `i` of `ring` may be cut off.
bool IsEar(const std::vector<int32_t>& ring, size_t i, const Vec3d& normal,
           const std::vector<Vec3d>& vertices) {
  const size_t n = ring.size();
  const int32_t ia = ring[(i + n - 1) % n], ib = ring[i], ic = ring[(i + 1) % n];
  const Vec3d &a = vertices[ia], &b = vertices[ib], &c = vertices[ic];
  if (Dot(Cross(b - a, c - a), normal) <= 0) return false;
  for (int32_t other : ring) {
    if (other == ia || other == ib || other == ic) continue;
    if (Covers(a, b, c, vertices[other], normal)) return false;
  }
  return true;
}

}  // namespace

void TriangulatePolygon(std::span<const int32_t> corners, const std::vector<Vec3d>& vertices,
                        std::vector<Triangle>* triangles) {
  if (corners.size() == 3) {
    triangles->push_back({corners[0], corners[1], corners[2]});
    return;
  }
  if (corners.size() == 4) {
    SplitQuad(corners, vertices, triangles);
    return;
  }
  const Vec3d normal = PolygonNormal(corners, vertices);
  std::vector<int32_t> ring(corners.begin(), corners.end());
  size_t start = 0;
  while (ring.size() > 3) {
    const size_t n = ring.size();
    size_t ear = start % n;
    for (size_t k = 0; k < n; ++k) {
      if (IsEar(ring, (start + k) % n, normal, vertices)) {
        ear = (start + k) % n;
        break;
      }
    }
    triangles->push_back({ring[(ear + n - 1) % n], ring[ear], ring[(ear + 1) % n]});
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(ear));
    // Going on two corners later keeps the pieces of a disc from becoming a thin fan.
    start = ear + 1;
  }
  triangles->push_back({ring[0], ring[1], ring[2]});
}

absl::Status HullBuilder::AddPolygon(std::span<const int64_t> corners) {
  if (corners.size() < 3) {
    return absl::InvalidArgumentError(
        absl::StrCat("a face has ", corners.size(), " corners; at least 3 are needed"));
  }
  if (corners.size() > static_cast<size_t>(kMaxPolygonCorners)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "a face has ", corners.size(), " corners; at most ", kMaxPolygonCorners, " are supported"));
  }
  for (int64_t corner : corners) {
    if (corner < 0 || corner > std::numeric_limits<int32_t>::max()) {
      return absl::InvalidArgumentError(
          absl::StrCat("a face names vertex ", corner, " (counted from 0), which cannot exist"));
    }
  }
  for (int64_t corner : corners) face_corners_.push_back(static_cast<int32_t>(corner));
  face_sizes_.push_back(static_cast<int32_t>(corners.size()));
  return absl::OkStatus();
}

absl::Status CheckFinite(const std::vector<Vec3d>& vectors, const char* what) {
  for (size_t i = 0; i < vectors.size(); ++i) {
    const Vec3d& v = vectors[i];
    if (std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z)) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        what, " ", i, " (counted from 0) is not finite: (", v.x, ", ", v.y, ", ", v.z, ")"));
  }
  return absl::OkStatus();
}

absl::StatusOr<InputHull> HullBuilder::Build() {
  if (vertices.empty()) return absl::InvalidArgumentError("the file contains no vertex");
  AMHEX_RETURN_IF_ERROR(CheckFinite(vertices, "vertex"));
  if (!has_faces()) {
    AMHEX_RETURN_IF_ERROR(CheckFinite(normals, "normal"));
    return InputHull(PointCloud{std::move(vertices), std::move(normals)});
  }
  TriangleMesh mesh;
  mesh.triangles.reserve(face_sizes_.size());
  const std::span<const int32_t> all_corners(face_corners_);
  size_t first = 0;
  for (size_t face = 0; face < face_sizes_.size(); ++face) {
    const std::span<const int32_t> corners =
        all_corners.subspan(first, static_cast<size_t>(face_sizes_[face]));
    first += corners.size();
    for (int32_t corner : corners) {
      if (static_cast<size_t>(corner) < vertices.size()) continue;
      return absl::InvalidArgumentError(absl::StrCat("face ", face, " names vertex ", corner,
                                                     ", but there are only ", vertices.size(),
                                                     " vertices (both counted from 0)"));
    }
    TriangulatePolygon(corners, vertices, &mesh.triangles);
  }
  mesh.vertices = std::move(vertices);
  return InputHull(std::move(mesh));
}

}  // namespace amhex::client
