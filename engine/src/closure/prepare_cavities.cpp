#include "closure/prepare_cavities.h"

#include <algorithm>
#include <numeric>
#include <vector>

#include "closure/cavities.h"
#include "closure/hull_patch.h"
#include "geometry/point_bins.h"
#include "input/hull_queries.h"
#include "optimize/cell_quality.h"

namespace amhex {
namespace {

constexpr int kMaxLooseGroup = 3;           // cells
constexpr int kLooseOpenFaces = 3;          // a cell with this many open faces and one neighbour
constexpr double kMaxSnapDistance = 0.85;   // of a face's centre to the hull, edge lengths
constexpr double kVertexSnapMargin = 0.25;  // a vertex may lie this much deeper
constexpr double kMinSnapQuality = 0.3;
constexpr double kMinNormalCosine = 0.5;

// The centre of a face that is declared hull may lie this deep below the hull or high above it, and
// its vertices this high.
constexpr double kMaxDeclaredDepth = 0.3;
constexpr double kMaxDeclaredHeight = 0.6;
constexpr double kMaxDeclaredVertexHeight = 0.3;

struct OpenFace {
  CellFace face;
  Vec3d centre, normal, hull_normal;
  double distance;
};

std::vector<OpenFace> OpenFacesByDistance(const Hull& hull, const WorkingMesh& mesh) {
  std::vector<OpenFace> faces;
  for (const CellFace& face : mesh.OpenFaces()) {
    OpenFace open{
        face, FaceCentroid(face, mesh.vertices()), FaceUnitNormal(face, mesh.vertices()), {}, 0};
    const HullPoint nearest = hull.queries->Closest(open.centre);
    open.hull_normal = nearest.normal;
    open.distance = nearest.distance;
    faces.push_back(open);
  }
  std::stable_sort(faces.begin(), faces.end(),
                   [](const OpenFace& a, const OpenFace& b) { return a.distance < b.distance; });
  return faces;
}

// True if another open face looks back at this one from before the hull: a cell belongs between.
bool IsBlocked(const OpenFace& open, const std::vector<OpenFace>& all, const PointBins& bins) {
  bool blocked = false;
  bins.ForEachWithin(open.centre, 0.9, [&](int i) {
    const Vec3d d = all[i].centre - open.centre;
    const double along = Dot(d, open.normal);
    blocked |= Dot(all[i].normal, open.normal) < -0.3 && along < open.distance + 0.1 &&
               along > -0.3 && Norm(d - open.normal * along) < 0.55;
  });
  return blocked;
}

class Snapper {
 public:
  Snapper(const Hull& hull, WorkingMesh* mesh)
      : hull_(hull), mesh_(*mesh), cells_at_(mesh->CellsAtVertices()) {
    on_hull_.assign(mesh->vertices().size(), 0);
    for (int cell = 0; cell < mesh_.cell_slots(); ++cell) {
      if (!mesh_.alive(cell)) continue;
      mesh_.VisitHullFaces(cell, [this](const CellFace& face) {
        for (int j = 0; j < face.count; ++j) on_hull_[face.v[j]] = 1;
      });
    }
  }

  bool TrySnap(const OpenFace& open) {
    std::vector<std::pair<int32_t, Vec3d>> saved;
    bool allowed = true;
    for (int j = 0; j < open.face.count && allowed; ++j) {
      const int32_t v = open.face.v[j];
      if (on_hull_[v]) continue;
      Vec3d& x = mesh_.vertices()[v];
      const HullPoint target = hull_.queries->Closest(x, kMaxSnapDistance + kVertexSnapMargin);
      allowed = target.triangle >= 0;
      saved.emplace_back(v, x);
      if (allowed) x = target.point;
    }
    for (const auto& [v, position] : saved) {
      for (const int cell : cells_at_[v]) {
        allowed = allowed && CellQuality(mesh_.corners(cell), mesh_.vertices()) >= kMinSnapQuality;
      }
    }
    if (!allowed) {
      for (const auto& [v, position] : saved) mesh_.vertices()[v] = position;
      return false;
    }
    mesh_.MarkHull(open.face);
    for (int j = 0; j < open.face.count; ++j) on_hull_[open.face.v[j]] = 1;
    return true;
  }

 private:
  const Hull& hull_;
  WorkingMesh& mesh_;
  std::vector<std::vector<int>> cells_at_;
  std::vector<uint8_t> on_hull_;
};

}  // namespace

int RemoveLooseCells(WorkingMesh* mesh) {
  const int count = mesh->cell_slots();
  std::vector<int> parent(count);
  std::iota(parent.begin(), parent.end(), 0);
  const auto find = [&](int a) {
    while (parent[a] != a) a = parent[a] = parent[parent[a]];
    return a;
  };
  for (int cell = 0; cell < count; ++cell) {
    if (!mesh->alive(cell)) continue;
    for (const int32_t half : mesh->half_faces(cell)) {
      const int32_t behind = half < 0 ? WorkingMesh::kOpen : mesh->owner(half ^ 1);
      if (behind >= 0)
        parent[std::max(find(cell), find(behind))] = std::min(find(cell), find(behind));
    }
  }
  std::vector<int> size(count, 0);
  for (int cell = 0; cell < count; ++cell) {
    if (mesh->alive(cell)) ++size[find(cell)];
  }
  int removed = 0;
  for (int cell = 0; cell < count; ++cell) {
    if (!mesh->alive(cell)) continue;
    int matched = 0, open = 0;
    for (const int32_t half : mesh->half_faces(cell)) {
      if (half < 0) break;
      const int32_t behind = mesh->owner(half ^ 1);
      matched += behind >= 0 ? 1 : 0;
      open += behind == WorkingMesh::kOpen ? 1 : 0;
    }
    // A small group that nothing is open at is a finished part of its own: it stays.
    const bool small_group = size[find(cell)] <= kMaxLooseGroup && open > 0;
    if (!small_group && (matched > 1 || open < kLooseOpenFaces)) continue;
    mesh->RemoveCell(cell);
    ++removed;
  }
  return removed;
}

int SnapFacesToHull(const Hull& hull, WorkingMesh* mesh) {
  const std::vector<OpenFace> faces = OpenFacesByDistance(hull, *mesh);
  std::vector<Vec3d> centres(faces.size());
  for (size_t i = 0; i < faces.size(); ++i) centres[i] = faces[i].centre;
  const PointBins bins(centres, 1.0);
  Snapper snapper(hull, mesh);
  int snapped = 0;
  for (const OpenFace& open : faces) {
    if (open.distance > kMaxSnapDistance) break;
    if (Dot(open.normal, open.hull_normal) < kMinNormalCosine) continue;
    if (!IsBlocked(open, faces, bins) && snapper.TrySnap(open)) ++snapped;
  }
  return snapped;
}

int DeclareHullFaces(const Hull& hull, WorkingMesh* mesh) {
  const auto& x = mesh->vertices();
  const auto depth_is_allowed = [&](const Vec3d& p, double inside, double outside) {
    const HullPoint nearest = hull.queries->Closest(p, outside);
    return nearest.triangle >= 0 && (nearest.distance <= inside || !hull.queries->IsInside(p));
  };
  const auto lies_on_hull = [&](const CellFace& face) {
    for (int j = 0; j < face.count; ++j) {
      if (!depth_is_allowed(x[face.v[j]], kOnHullDistance, kMaxDeclaredVertexHeight)) return false;
    }
    const Vec3d centre = FaceCentroid(face, x);
    return depth_is_allowed(centre, kMaxDeclaredDepth, kMaxDeclaredHeight) &&
           Dot(FaceUnitNormal(face, x), hull.queries->Closest(centre).normal) > 0;
  };
  int declared = 0;
  for (const auto& faces : CollectCavities(*mesh).faces) {
    if (!std::all_of(faces.begin(), faces.end(), lies_on_hull)) continue;
    for (const CellFace& face : faces) mesh->MarkHull(face);
    declared += static_cast<int>(faces.size());
  }
  return declared;
}

}  // namespace amhex
