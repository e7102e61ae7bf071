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
constexpr double kMinNormalCosine = 0.5;
// A vertex this near counts as being on the hull.
constexpr double kOnHullDistance = 0.12;
constexpr double kMaxVertexDistance = 1.7;
// An existing edge to the hull is taken for a column if it rises this steeply.
constexpr double kMinColumnCosine = 0.5;
constexpr double kMaxColumnLength = 1.9;
constexpr double kMinQuality = 0.25;
constexpr double kMaxTopDistance = 0.35;
// Corners are tested for overlap this far towards the centre.
constexpr double kOverlapShrink = 0.25;
constexpr double kOverlapReach = 1.6;

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
      for (const CellFace& face : FacesOf(mesh_.corners(cell))) {
        if (mesh_.Across(face) != WorkingMesh::kHull) continue;
        for (int j = 0; j < face.count; ++j) on_hull_[face.v[j]] = 1;
      }
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
  // Edges of open faces that rise from inside to the hull.
  void CollectColumns(const std::vector<CellFace>& faces) {
    for (const CellFace& face : faces) {
      for (int j = 0; j < face.count; ++j) {
        const int32_t a = face.v[j], b = face.v[(j + 1) % face.count];
        if (on_hull_[a] == on_hull_[b]) continue;
        columns_[on_hull_[a] ? b : a].insert(on_hull_[a] ? a : b);
      }
    }
  }

  // The hull end of the column over `v`; -1 if there is none.
  int32_t TopOf(int32_t v) {
    if (on_hull_[v]) return v;
    const auto [it, inserted] = top_.try_emplace(v, -1);
    if (!inserted) return it->second;
    const Vec3d x = mesh_.vertices()[v];
    const HullPoint nearest = hull_.queries->Closest(x, kMaxVertexDistance);
    if (nearest.triangle < 0) return -1;
    if (nearest.distance < kOnHullDistance) return it->second = v;
    double best = kMinColumnCosine;
    if (const auto columns = columns_.find(v); columns != columns_.end()) {
      for (const int32_t end : columns->second) {
        const Vec3d d = mesh_.vertices()[end] - x;
        const double length = Norm(d);
        if (length > kMaxColumnLength) continue;
        const double cosine = Dot(d, nearest.normal) / length;
        if (cosine > best) best = cosine, it->second = end;
      }
    }
    if (it->second < 0) {
      it->second = mesh_.AddVertex(nearest.point);
      on_hull_.push_back(1);
      used_.push_back(0);
    }
    return it->second;
  }

  bool LooksAtHull(const CellFace& face) const {
    const HullPoint nearest =
        hull_.queries->Closest(FaceCentroid(face, mesh_.vertices()), kMaxFaceDistance);
    return nearest.triangle >= 0 && nearest.distance > kMinFaceDistance &&
           Dot(FaceUnitNormal(face, mesh_.vertices()), nearest.normal) > kMinNormalCosine;
  }

  int ExtrudeCavity(const std::vector<CellFace>& faces) {
    std::vector<int> added;
    int change = 0;  // of the number of open faces
    for (const CellFace& face : faces) {
      if (!LooksAtHull(face)) continue;
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
    std::array<int32_t, 4> top{};
    for (int j = 0; j < face.count; ++j) {
      top[j] = TopOf(face.v[j]);
      if (top[j] < 0) return -1;
    }
    const auto& v = face.v;
    const CellCorners corners =
        face.count == 4 ? CellCorners{v[0], v[1], v[2], v[3], top[0], top[1], top[2], top[3]}
                        : CellCorners{v[0], v[1], v[1], v[2], top[0], top[1], top[1], top[2]};
    if (CellQuality(corners, mesh_.vertices()) < kMinQuality || Overlaps(corners)) return -1;
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
    for (const int32_t v : vertices) probes.push_back(x[v] + (centre - x[v]) * kOverlapShrink);
    bool overlaps = false;
    cell_bins_->ForEachWithin(centre, kOverlapReach, [&](int i) {
      if (overlaps || !mesh_.alive(cells_[i])) return;
      for (const Vec3d& probe : probes) {
        overlaps = overlaps || CellContains(mesh_.corners(cells_[i]), x, probe);
      }
    });
    vertex_bins_->ForEachWithin(centre, kOverlapReach, [&](int v) {
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
           Dot(FaceUnitNormal(face, mesh_.vertices()), nearest.normal) > kMinNormalCosine;
  }

  const Hull& hull_;
  WorkingMesh& mesh_;
  std::vector<uint8_t> on_hull_, used_;
  std::vector<int> cells_;
  std::vector<Vec3d> centres_, positions_;
  std::map<int32_t, std::set<int32_t>> columns_;
  std::map<int32_t, int32_t> top_;
  const PointBins* cell_bins_ = nullptr;
  const PointBins* vertex_bins_ = nullptr;
};

}  // namespace

int ExtrudeToHull(const Hull& hull, WorkingMesh* mesh) { return Extruder(hull, mesh).Run(); }

}  // namespace amhex
