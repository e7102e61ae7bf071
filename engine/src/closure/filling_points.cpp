#include "closure/filling_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "absl/container/flat_hash_set.h"
#include "geometry/point_bins.h"
#include "input/hull_queries.h"

namespace amhex {
namespace {

constexpr double kPointReach = 1.6;       // hull points this near to an open face may be needed
constexpr double kMinSpacing = 0.62;      // between new points, and from existing vertices
constexpr double kFeatureSpacing = 0.35;  // corners and sharp edges are worth shorter edges
constexpr double kCandidateSpacing = 0.5 * kMinSpacing;
constexpr double kLeastNeedle = 2.0;  // triangles shorter than this are cheap however thin
constexpr double kHullFaceClearance =
    0.3;                                 // hull points nearer to an existing hull face are its own
constexpr double kInteriorDepth = 0.55;  // interior points keep this far from the hull
constexpr double kInteriorSpacing = 0.8;

class PointAdder {
 public:
  PointAdder(const Hull& hull, const Cavities& cavities, const FillScope& scope, WorkingMesh* mesh)
      : hull_(hull), mesh_(*mesh) {
    for (const int cavity : scope.cavities) {
      for (const CellFace& face : cavities.faces[cavity]) {
        open_centres_.push_back(FaceCentroid(face, mesh->vertices()));
      }
    }
    CollectExisting(scope);
  }

  std::vector<int> Run() {
    if (open_centres_.empty()) return {};
    const PointBins open_bins(open_centres_, 1.0);
    open_bins_ = &open_bins;
    const PointBins vertex_bins(vertices_, 1.0);
    vertex_bins_ = &vertex_bins;
    const PointBins cell_bins(cell_centres_, 1.0);
    cell_bins_ = &cell_bins;
    const PointBins face_bins(hull_face_centres_, 1.0);
    hull_face_bins_ = &face_bins;
    AddFeatures();
    AddHullPoints();
    AddInteriorPoints();
    return added_;
  }

 private:
  void CollectExisting(const FillScope& scope) {
    std::vector<uint8_t> used(mesh_.vertices().size(), 0);
    for (const int cell : scope.cells) {
      const CellVertices vertices = VerticesOf(mesh_.corners(cell));
      Vec3d centre;
      for (const int32_t v : vertices) {
        used[v] = 1;
        centre += mesh_.vertices()[v];
      }
      cell_centres_.push_back(centre / vertices.count);
      cells_.push_back(cell);
      mesh_.VisitHullFaces(cell, [this](const CellFace& face) {
        hull_faces_.push_back(face);
        hull_face_centres_.push_back(FaceCentroid(face, mesh_.vertices()));
      });
    }
    for (size_t v = 0; v < used.size(); ++v) {
      if (used[v]) vertices_.push_back(mesh_.vertices()[v]);
    }
  }

  bool NearCavity(const Vec3d& p, double reach) const {
    bool near = false;
    open_bins_->ForEachWithin(p, reach, [&](int) { near = true; });
    return near;
  }

  bool IsFarFromPoints(const Vec3d& p, double spacing) const {
    bool far = true;
    vertex_bins_->ForEachWithin(p, spacing, [&](int) { far = false; });
    for (size_t i = new_points_.size(); far && i-- > 0;) {
      far = SquaredNorm(new_points_[i] - p) > spacing * spacing;
    }
    return far;
  }

  // On the hull: is the place covered by a hull face of a remaining cell?
  bool IsCoveredOnHull(const Vec3d& p) const {
    bool covered = false;
    hull_face_bins_->ForEachWithin(p, 1.2, [&](int i) {
      const CellFace& face = hull_faces_[i];
      const auto& x = mesh_.vertices();
      for (int s = 0; s + 2 < face.count; ++s) {
        covered |= IsAbove(p, x[face.v[0]], x[face.v[1 + s]], x[face.v[2 + s]]);
      }
    });
    return covered;
  }

  static bool IsAbove(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const Vec3d normal = Cross(b - a, c - a);
    const double area2 = SquaredNorm(normal);
    if (area2 <= 0) return false;
    if (std::abs(Dot(p - a, normal)) > kHullFaceClearance * std::sqrt(area2)) return false;
    constexpr double kBorder = -0.05;  // barycentric: a little beyond the border still counts
    return Dot(Cross(b - a, p - a), normal) > kBorder * area2 &&
           Dot(Cross(c - b, p - b), normal) > kBorder * area2 &&
           Dot(Cross(a - c, p - c), normal) > kBorder * area2;
  }

  bool IsInsideCell(const Vec3d& p) const {
    bool inside = false;
    cell_bins_->ForEachWithin(p, 1.5, [&](int i) {
      if (inside) return;
      const auto& x = mesh_.vertices();
      bool within = true;
      for (const CellFace& face : FacesOf(mesh_.corners(cells_[i]))) {
        for (int s = 0; s + 2 < face.count && within; ++s) {
          const Vec3d& a = x[face.v[0]];
          within = Dot(Cross(x[face.v[1 + s]] - a, x[face.v[2 + s]] - a), p - a) < 0;
        }
        if (!within) break;
      }
      inside = within;
    });
    return inside;
  }

  void Add(const Vec3d& p) {
    new_points_.push_back(p);
    added_.push_back(mesh_.AddVertex(p));
  }

  void TryHullPoint(const Vec3d& p, double spacing) {
    if (!NearCavity(p, kPointReach) || !IsFarFromPoints(p, spacing) || IsCoveredOnHull(p)) return;
    Add(p);
  }

  void AddFeatures() {
    for (size_t v = 0; v < hull_.vertices.size(); ++v) {
      if (hull_.sharp_degree[v] >= 3) TryHullPoint(hull_.vertices[v], kFeatureSpacing);
    }
    for (const SharpEdge& edge : hull_.sharp_edges) {
      const Vec3d& a = hull_.vertices[edge.vertex_a];
      const Vec3d d = hull_.vertices[edge.vertex_b] - a;
      const int steps = std::max(1, static_cast<int>(std::ceil(Norm(d) / kFeatureSpacing)));
      for (int k = 0; k <= steps; ++k) TryHullPoint(a + d * (double(k) / steps), kMinSpacing);
    }
  }

  void AddHullPoints() {
    Box3d near;
    for (const Vec3d& centre : open_centres_) near.Extend(centre);
    near.low -= Vec3d{kPointReach, kPointReach, kPointReach};
    near.high += Vec3d{kPointReach, kPointReach, kPointReach};
    for (const auto& t : hull_.triangles) {
      std::array<Vec3d, 3> corners;
      for (size_t i = 0; i < 3; ++i) corners[i] = hull_.vertices[static_cast<size_t>(t[i])];
      const Vec3d low = ComponentMin(ComponentMin(corners[0], corners[1]), corners[2]);
      const Vec3d high = ComponentMax(ComponentMax(corners[0], corners[1]), corners[2]);
      if (!IsBelow(low, near.high) || !IsBelow(near.low, high)) continue;
      if (IsNeedle(corners)) {
        TryNeedle(corners, near);
      } else {
        TryTriangle(corners);
      }
    }
  }

  static bool IsBelow(const Vec3d& a, const Vec3d& b) {
    return a.x <= b.x && a.y <= b.y && a.z <= b.z;
  }

  // Turns the corners so that the longest edge comes first; true where nothing is far from it.
  static bool IsNeedle(std::array<Vec3d, 3>& corners) {
    const auto squared = [&](size_t i) { return SquaredNorm(corners[(i + 1) % 3] - corners[i]); };
    size_t first = 0;
    for (size_t i = 1; i < 3; ++i) {
      if (squared(i) > squared(first)) first = i;
    }
    const double longest = std::sqrt(squared(first));
    if (longest <= kLeastNeedle) return false;
    const double height = Norm(Cross(corners[1] - corners[0], corners[2] - corners[0])) / longest;
    if (height > kCandidateSpacing) return false;
    std::rotate(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(first),
                corners.end());
    return true;
  }

  // Candidates along the longest edge, as far as it runs through `near`. Of the many that a fan of
  // needles has at one place the first is tried.
  void TryNeedle(const std::array<Vec3d, 3>& corners, const Box3d& near) {
    const Vec3d along = corners[1] - corners[0];
    double begin = 0, end = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const double low = near.low[axis] - corners[0][axis];
      const double high = near.high[axis] - corners[0][axis];
      if (along[axis] == 0) {
        if (low > 0 || high < 0) return;
        continue;
      }
      begin = std::max(begin, std::min(low / along[axis], high / along[axis]));
      end = std::min(end, std::max(low / along[axis], high / along[axis]));
    }
    const double steps = std::ceil(Norm(along) / kCandidateSpacing);
    for (double k = std::ceil(begin * steps); k <= end * steps; ++k) {
      const Vec3d p = corners[0] + along * (k / steps);
      std::array<int64_t, 3> place;
      for (int axis = 0; axis < 3; ++axis) {
        place[axis] = static_cast<int64_t>(std::floor(p[axis] / (0.5 * kCandidateSpacing)));
      }
      if (tried_places_.insert(place).second) TryHullPoint(p, kMinSpacing);
    }
  }

  void TryTriangle(const std::array<Vec3d, 3>& corners) {
    const Vec3d& a = corners[0];
    const Vec3d ab = corners[1] - a, ac = corners[2] - a;
    const double length = std::max({Norm(ab), Norm(ac), Norm(ac - ab)});
    const Vec3d centre = a + (ab + ac) / 3.0;
    if (length < kLeastNeedle && !NearCavity(centre, kPointReach + length)) return;
    const int steps = std::max(1, static_cast<int>(std::ceil(length / kCandidateSpacing)));
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j) {
        TryHullPoint(a + ab * (double(i) / steps) + ac * (double(j) / steps), kMinSpacing);
      }
    }
  }

  // Candidates half an edge length apart around the open faces, in front of them.
  void AddInteriorPoints() {
    constexpr double kStep = 0.5;
    for (const Vec3d& centre : open_centres_) {
      for (int k = 0; k < 27; ++k) {
        const int x = k % 3, y = k / 3 % 3, z = k / 9;
        const Vec3d offset{x - 1.0, y - 1.0, z - 1.0};
        // Snapped to a lattice so that neighbouring faces propose the same points.
        Vec3d p = centre + offset;
        for (int axis = 0; axis < 3; ++axis) p[axis] = std::round(p[axis] / kStep) * kStep;
        if (!IsFarFromPoints(p, kInteriorSpacing)) continue;
        if (hull_.queries->Closest(p, kInteriorDepth).triangle >= 0) continue;
        if (!hull_.queries->IsInside(p) || IsInsideCell(p)) continue;
        Add(p);
      }
    }
  }

  const Hull& hull_;
  WorkingMesh& mesh_;
  std::vector<Vec3d> open_centres_, vertices_, cell_centres_, hull_face_centres_, new_points_;
  std::vector<int> cells_, added_;
  std::vector<CellFace> hull_faces_;
  const PointBins* open_bins_ = nullptr;
  const PointBins* vertex_bins_ = nullptr;
  const PointBins* cell_bins_ = nullptr;
  const PointBins* hull_face_bins_ = nullptr;
  absl::flat_hash_set<std::array<int64_t, 3>> tried_places_;  // of needles; only looked up
};

}  // namespace

std::vector<int> AddFillingPoints(const Hull& hull, const Cavities& cavities,
                                  const FillScope& scope, WorkingMesh* mesh) {
  return PointAdder(hull, cavities, scope, mesh).Run();
}

}  // namespace amhex
