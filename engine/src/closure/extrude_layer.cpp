#include "closure/extrude_layer.h"

#include <algorithm>
#include <map>
#include <set>

#include "closure/cell_contains.h"
#include "geometry/point_bins.h"
#include "input/hull_queries.h"
#include "optimize/cell_quality.h"

namespace amhex {
namespace {

// Faces nearer to the hull than this are hull faces themselves, farther ones miss two layers.
constexpr double kMinFaceDistance = 0.2;
constexpr double kMaxFaceDistance = 1.45;
constexpr double kLookStep = 0.3;
constexpr double kLayerNormalCosine = 0.5;
// A vertex this far below the sheet of the hull that a face looks at is on it; one that lies on
// the hull already may be a little farther, as hulls are curved.
constexpr double kLayerOnHullDistance = 0.12;
constexpr double kOnSheetDistance = 0.3;
// The hull may be this far from where its tangent plane lets one expect it.
constexpr double kMaxTargetDistance = 0.5;
// An existing edge to the hull is taken for a column if it rises this steeply.
constexpr double kMinColumnCosine = 0.5;
constexpr double kMaxColumnLength = 1.9;
constexpr double kMinLayerQuality = 0.25;
constexpr double kMaxTopDistance = 0.35;
// Corners are tested for overlap this far towards the centre.
constexpr double kLayerOverlapShrink = 0.25;
constexpr double kLayerOverlapReach = 1.6;

class Extruder {
 public:
  Extruder(const Hull& hull, WorkingMesh* mesh) : hull_(hull), mesh_(*mesh) {
    on_hull_.assign(mesh_.vertices().size(), 0);
    used_.assign(mesh_.vertices().size(), 0);
    for (int cell = 0; cell < mesh_.cell_slots(); ++cell) {
      if (!mesh_.alive(cell)) continue;
      Vec3d centre;
      const CellVertices vertices = VerticesOf(mesh_.corners(cell));
      for (const int32_t v : vertices) {
        used_[v] = 1;
        centre += mesh_.vertices()[v];
      }
      cells_.push_back(cell);
      centres_.push_back(centre / vertices.count);
      mesh_.VisitHullFaces(cell, [this](const CellFace& face) {
        for (int j = 0; j < face.count; ++j) on_hull_[face.v[j]] = 1;
      });
    }
    positions_ = mesh_.vertices();
  }

  int Run() {
    const Cavities cavities = CollectCavities(mesh_);
    const PointBins cell_bins(centres_, 1.0);
    const PointBins vertex_bins(positions_, 1.0);
    cell_bins_ = &cell_bins;
    vertex_bins_ = &vertex_bins;
    for (const auto& faces : cavities.faces) CollectColumns(faces);
    int added = 0;
    for (const auto& faces : cavities.faces) added += ExtrudeCavity(faces);
    return added;
  }

 private:
  // Edges of open faces that end on the hull.
  void CollectColumns(const std::vector<CellFace>& faces) {
    for (const CellFace& face : faces) {
      for (int j = 0; j < face.count; ++j) {
        const int32_t a = face.v[j], b = face.v[(j + 1) % face.count];
        if (on_hull_[b]) columns_[a].insert(b);
        if (on_hull_[a]) columns_[b].insert(a);
      }
    }
  }

  // The hull end of the column over `v` towards the hull at `foot`; -1 if there is none. A vertex
  // may have several: at an edge of the hull, one column along each sheet.
  int32_t TopOf(int32_t v, const HullPoint& foot) {
    const Vec3d x = mesh_.vertices()[v];
    const double height = Dot(foot.normal, foot.point - x);
    if (height < (on_hull_[v] ? kOnSheetDistance : kLayerOnHullDistance)) return v;
    auto& tops = tops_[v];
    for (const int32_t top : tops) {
      if (Rises(x, mesh_.vertices()[top], foot.normal)) return top;
    }
    const HullPoint target = hull_.queries->Closest(x + foot.normal * height, kMaxTargetDistance);
    if (target.triangle < 0 || !Rises(x, target.point, foot.normal)) return -1;
    int32_t top = ColumnNear(v, target.point);
    if (top < 0) {
      top = mesh_.AddVertex(target.point);
      on_hull_.push_back(1);
      used_.push_back(0);
    }
    tops_[v].push_back(top);
    return top;
  }

  static bool Rises(const Vec3d& from, const Vec3d& to, const Vec3d& normal) {
    const double length = Norm(to - from);
    return length < kMaxColumnLength && Dot(to - from, normal) > kMinColumnCosine * length;
  }

  // The end of an existing edge that rises from `v` to about `target`.
  int32_t ColumnNear(int32_t v, const Vec3d& target) const {
    const auto columns = columns_.find(v);
    if (columns == columns_.end()) return -1;
    int32_t best = -1;
    double distance = kMaxTargetDistance;
    for (const int32_t end : columns->second) {
      const double d = Norm(mesh_.vertices()[end] - target);
      if (d < distance) distance = d, best = end;
    }
    return best;
  }

  // Where the hull lies that an open face looks at, if it does: looked for along the face's
  // normal, as beside a wall of the hull the nearest point is the wall's.
  HullPoint FootOf(const CellFace& face) const {
    const Vec3d centre = FaceCentroid(face, mesh_.vertices());
    const Vec3d normal = FaceUnitNormal(face, mesh_.vertices());
    for (double ahead = 0; ahead < kMaxFaceDistance; ahead += kLookStep) {
      const HullPoint foot = hull_.queries->Closest(centre + normal * ahead, kMaxFaceDistance);
      if (foot.triangle < 0 || Dot(foot.normal, normal) < kLayerNormalCosine) continue;
      const double height = Dot(foot.point - centre, foot.normal);
      if (height > kMinFaceDistance && height < kMaxFaceDistance) return foot;
    }
    return {};
  }

  int ExtrudeCavity(const std::vector<CellFace>& faces) {
    std::vector<int> added;
    int change = 0;  // of the number of open faces
    for (const CellFace& face : faces) {
      const int cell = ExtrudeFace(face);
      if (cell < 0) continue;
      added.push_back(cell);
    }
    // Judged together: the sides of neighbouring columns match only once all of them stand.
    for (const int cell : added) change += MarkTopAndCount(cell, added);
    if (change < 0) return static_cast<int>(added.size());
    for (const int cell : added) mesh_.RemoveCell(cell);
    return 0;
  }

  int ExtrudeFace(const CellFace& face) {
    const HullPoint foot = FootOf(face);
    if (foot.triangle < 0) return -1;
    std::array<int32_t, 4> top{};
    for (int j = 0; j < face.count; ++j) {
      top[j] = TopOf(face.v[j], foot);
      if (top[j] < 0) return -1;
    }
    const auto& v = face.v;
    const CellCorners corners =
        face.count == 4 ? CellCorners{v[0], v[1], v[2], v[3], top[0], top[1], top[2], top[3]}
                        : CellCorners{v[0], v[1], v[1], v[2], top[0], top[1], top[1], top[2]};
    if (CellQuality(corners, mesh_.vertices()) < kMinLayerQuality || Overlaps(corners)) return -1;
    return mesh_.AddCell(corners);
  }

  // True if the new cell reaches into a cell or a vertex reaches into it.
  bool Overlaps(const CellCorners& corners) const {
    const auto& x = mesh_.vertices();
    const CellVertices vertices = VerticesOf(corners);
    Vec3d centre;
    for (const int32_t v : vertices) centre += x[v];
    centre /= vertices.count;
    std::vector<Vec3d> probes = {centre};
    for (const int32_t v : vertices) probes.push_back(x[v] + (centre - x[v]) * kLayerOverlapShrink);
    bool overlaps = false;
    cell_bins_->ForEachWithin(centre, kLayerOverlapReach, [&](int i) {
      if (overlaps || !mesh_.alive(cells_[i])) return;
      for (const Vec3d& probe : probes) {
        overlaps = overlaps || CellContains(mesh_.corners(cells_[i]), x, probe);
      }
    });
    vertex_bins_->ForEachWithin(centre, kLayerOverlapReach, [&](int v) {
      if (overlaps || !used_[v]) return;
      if (std::find(vertices.begin(), vertices.end(), v) != vertices.end()) return;
      overlaps = CellContains(corners, x, x[v]);
    });
    return overlaps;
  }

  // Open faces gained by this cell: one closed per match with an older cell, one opened per side
  // that nothing matches.
  int MarkTopAndCount(int cell, const std::vector<int>& added) {
    int change = 0;
    for (const CellFace& face : FacesOf(mesh_.corners(cell))) {
      const int32_t behind = mesh_.Across(face);
      if (behind >= 0) {
        change -= std::binary_search(added.begin(), added.end(), behind) ? 0 : 1;
      } else if (IsTop(face)) {
        mesh_.MarkHull(face);
      } else {
        ++change;
      }
    }
    return change;
  }

  bool IsTop(const CellFace& face) const {
    for (int j = 0; j < face.count; ++j) {
      if (!on_hull_[face.v[j]]) return false;
    }
    const HullPoint nearest =
        hull_.queries->Closest(FaceCentroid(face, mesh_.vertices()), kMaxTopDistance);
    return nearest.triangle >= 0 &&
           Dot(FaceUnitNormal(face, mesh_.vertices()), nearest.normal) > kLayerNormalCosine;
  }

  const Hull& hull_;
  WorkingMesh& mesh_;
  std::vector<uint8_t> on_hull_, used_;
  std::vector<int> cells_;
  std::vector<Vec3d> centres_, positions_;
  std::map<int32_t, std::set<int32_t>> columns_;
  std::map<int32_t, std::vector<int32_t>> tops_;
  const PointBins* cell_bins_ = nullptr;
  const PointBins* vertex_bins_ = nullptr;
};

}  // namespace

int ExtrudeToHull(const Hull& hull, WorkingMesh* mesh) { return Extruder(hull, mesh).Run(); }

}  // namespace amhex
