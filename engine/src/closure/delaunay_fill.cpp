#include "closure/delaunay_fill.h"

#include <algorithm>
#include <array>
#include <vector>

#include "closure/filling_points.h"
#include "closure/star_geometry.h"
#include "closure/tetrahedral_cover.h"
#include "input/hull_queries.h"
#include "topology/primitives.h"

namespace amhex {
namespace {

// Flat tetrahedra between hull vertices lie outside if they are nearer to the hull than this.
constexpr double kHullSliverDepth = 0.15;
constexpr double kSliverOnHullDistance = 0.02;
// A tetrahedron outside may complete the one inside at the same quad if it is this near.
constexpr double kMaxBridgeDistance = 0.3;
// Faces deeper than this under the hull cannot become part of it.
constexpr double kMaxHullFaceDepth = 0.45;
// Cells with contradictory sides are given up and the cover is made again, this often.
constexpr int kMaxCoverRounds = 12;
// A pyramid is taken instead of two tetrahedra if it is at least this good.
constexpr double kMinPyramidQuality = 0.03;

class DelaunayFiller {
 public:
  DelaunayFiller(const Hull& hull, const Cavities& cavities, const FillScope& scope, uint64_t seed,
                 WorkingMesh* mesh)
      : hull_(hull),
        cavities_(cavities),
        scope_(scope),
        mesh_(*mesh),
        cover_(*mesh, scope, AddFillingPoints(hull, cavities, scope, mesh), seed) {}

  bool Run() {
    if (cover_.tetrahedra().count() == 0) return false;
    std::vector<uint8_t> excluded(mesh_.cell_slots(), 0);
    for (int round = 0; round < kMaxCoverRounds; ++round) {
      cover_.CoverCells(excluded);
      Flood();
      if (escaped_) return false;
      if (contradictions_.empty()) break;
      for (const int cell : contradictions_) excluded[cell] = 1;
    }
    if (CellsAdded() > scope_.max_added_cells) return false;
    Replace();
    return true;
  }

 private:
  enum class Side : uint8_t { kUnknown, kInside, kOutside };

  // An upper bound: tetrahedra that become pyramids count twice.
  int64_t CellsAdded() const {
    return std::count(visited_.begin(), visited_.end(), 1) -
           std::count(dying_.begin(), dying_.end(), 1);
  }

  void Flood() {
    const int count = cover_.tetrahedra().count();
    side_.assign(count, Side::kUnknown);
    visited_.assign(count, 0);
    behind_hull_face_.assign(count, 0);
    dying_.assign(mesh_.cell_slots(), 0);
    cavity_done_.assign(cavities_.count(), 0);
    contradictions_.clear();
    escaped_ = false;
    in_scope_.assign(mesh_.cell_slots(), 0);
    for (const int cell : scope_.cells) in_scope_[cell] = 1;
    pending_.clear();
    pending_cells_.clear();
    LocateUncoveredCells();
    for (const int cavity : scope_.cavities) OpenCavity(cavity);
    while (!escaped_ && (!pending_.empty() || !pending_cells_.empty())) {
      if (!pending_.empty()) {
        const int t = pending_.back();
        pending_.pop_back();
        Enter(t);
      } else {
        const int cell = pending_cells_.back();
        pending_cells_.pop_back();
        Dissolve(cell);
      }
    }
  }

  void LocateUncoveredCells() {
    cells_in_.assign(cover_.tetrahedra().count(), {});
    for (const int cell : scope_.cells) {
      if (cover_.IsCovered(cell)) continue;
      const CellVertices vertices = VerticesOf(mesh_.corners(cell));
      Vec3d centre;
      for (const int32_t v : vertices) centre += mesh_.vertices()[v];
      const int t = cover_.Containing(centre / vertices.count, vertices.v[0]);
      if (t >= 0) cells_in_[t].push_back(cell);
    }
  }

  void OpenCavity(int cavity) {
    if (cavity_done_[cavity]) return;
    cavity_done_[cavity] = 1;
    for (const CellFace& face : cavities_.faces[cavity]) {
      TakeFace(mesh_.Owner(face), face);
    }
  }

  // The far side of this face of `cell` belongs to the region.
  void TakeFace(int cell, const CellFace& face) {
    if (cell < 0) return;
    if (!cover_.IsCovered(cell)) {
      Kill(cell);
      return;
    }
    for (const int t : cover_.TetrahedraBehind(cell, face)) Visit(t);
  }

  void Kill(int cell) {
    if (dying_[cell]) return;
    escaped_ = escaped_ || !in_scope_[cell];
    dying_[cell] = 1;
    pending_cells_.push_back(cell);
  }

  void Dissolve(int cell) {
    for (const CellFace& face : FacesOf(mesh_.corners(cell))) {
      const int half = mesh_.FindHalfFace(face);
      const int32_t behind = mesh_.owner(half ^ 1);
      if (behind >= 0) {
        TakeFace(behind, Reversed(face));
      } else if (behind == WorkingMesh::kOpen && cavities_.Of(half) >= 0) {
        OpenCavity(cavities_.Of(half));
      }
    }
  }

  void Visit(int t) {
    if (visited_[t] || cover_.occupant(t) != TetrahedralCover::kFree) return;
    if (SideOf(t) != Side::kInside) return;
    visited_[t] = 1;
    escaped_ = escaped_ || ReachesBorder(t);
    pending_.push_back(t);
  }

  bool ReachesBorder(int t) const {
    if (!scope_.is_local) return false;
    const Vec3d centre = CentreOf(t);
    const Box3d& box = scope_.safe_box;
    return !(ComponentMax(box.low, centre) == centre && ComponentMin(box.high, centre) == centre);
  }

  void Enter(int t) {
    for (const int cell : cells_in_[t]) Kill(cell);
    for (int i = 0; i < 4; ++i) {
      const auto across = cover_.Across(t, i);
      if (across.cell < 0) {
        Visit(across.tetrahedron);
        continue;
      }
      if (across.face.count == 0) continue;
      const int half = mesh_.FindHalfFace(across.face);
      const int32_t behind = mesh_.owner(half ^ 1);
      if (behind >= 0 && !cover_.IsCovered(behind)) Kill(behind);
      if (behind == WorkingMesh::kOpen && cavities_.Of(half) >= 0) OpenCavity(cavities_.Of(half));
    }
  }

  // What lies behind a hull face of a covered cell is outside; the hull decides the rest.
  Side OwnSide(int t) {
    if (side_[t] != Side::kUnknown) return side_[t];
    for (int i = 0; i < 4; ++i) {
      const auto across = cover_.Across(t, i);
      if (across.cell >= 0 && across.face.count > 0 &&
          mesh_.Across(across.face) == WorkingMesh::kHull) {
        behind_hull_face_[t] = 1;
        return side_[t] = Side::kOutside;
      }
    }
    return side_[t] = IsInsideHull(t) ? Side::kInside : Side::kOutside;
  }

  // The two tetrahedra behind one quad go together, or half of the quad would stay open.
  Side SideOf(int t) {
    const Side own = OwnSide(t);
    for (int i = 0; i < 4; ++i) {
      const auto across = cover_.Across(t, i);
      if (across.cell < 0 || across.face.count != 4) continue;
      if (mesh_.Across(across.face) == WorkingMesh::kHull) continue;
      for (const int partner : cover_.TetrahedraBehind(across.cell, across.face)) {
        if (partner == t || OwnSide(partner) == own) continue;
        const int inner = own == Side::kInside ? t : partner;
        const int outer = own == Side::kInside ? partner : t;
        if (!behind_hull_face_[outer] && DistanceToHull(outer) < kMaxBridgeDistance) {
          return Side::kInside;
        }
        if (DistanceToHull(inner) < kHullSliverDepth) return Side::kOutside;
        contradictions_.push_back(across.cell);
      }
    }
    return own;
  }

  Vec3d CentreOf(int t) const {
    Vec3d centre;
    for (const int32_t v : cover_.tetrahedra().vertices[t]) {
      if (v >= 0) centre += mesh_.vertices()[v] * 0.25;
    }
    return centre;
  }

  double DistanceToHull(int t) const {
    if (!cover_.tetrahedra().IsFinite(t)) return 1e300;
    return hull_.queries->Closest(CentreOf(t)).distance;
  }

  bool IsInsideHull(int t) const {
    const auto& v = cover_.tetrahedra().vertices[t];
    if (!cover_.tetrahedra().IsFinite(t)) return false;
    const Vec3d centre = CentreOf(t);
    const bool all_on_hull = std::all_of(v.begin(), v.end(), [&](int32_t id) {
      return hull_.queries->IsWithin(mesh_.vertices()[id], kSliverOnHullDistance);
    });
    if (all_on_hull && hull_.queries->IsWithin(centre, kHullSliverDepth)) return false;
    return hull_.queries->IsInside(centre);
  }

  void Replace() {
    const auto& tetrahedra = cover_.tetrahedra();
    for (int cell = 0; cell < static_cast<int>(dying_.size()); ++cell) {
      if (dying_[cell] && mesh_.alive(cell)) mesh_.RemoveCell(cell);
    }
    std::vector<uint8_t> done(tetrahedra.count(), 0);
    for (int t = 0; t < tetrahedra.count(); ++t) {
      if (visited_[t] && !done[t]) JoinToPyramid(t, &done);
    }
    for (int t = 0; t < tetrahedra.count(); ++t) {
      if (!visited_[t] || done[t]) continue;
      const auto [a, b, c, d] = tetrahedra.vertices[t];
      // MakeTetrahedron wants 0-2-1 as its outward base: d lies on the inner side of a, b, c.
      mesh_.AddCell(MakeTetrahedron(a, b, c, d));
    }
    for (int t = 0; t < tetrahedra.count(); ++t) {
      if (visited_[t]) MarkHullFaces(t);
    }
    MarkFacesTowardsOutside();
  }

  // Two tetrahedra of one apex behind one quad of a covered cell are a pyramid.
  void JoinToPyramid(int t, std::vector<uint8_t>* done) {
    for (int i = 0; i < 4; ++i) {
      const auto across = cover_.Across(t, i);
      if (across.cell < 0 || across.face.count != 4) continue;
      const int32_t apex = cover_.tetrahedra().vertices[t][i];
      for (const int other : cover_.TetrahedraBehind(across.cell, across.face)) {
        const auto& v = cover_.tetrahedra().vertices[other];
        if (other == t || !visited_[other] || (*done)[other] ||
            std::find(v.begin(), v.end(), apex) == v.end()) {
          continue;
        }
        if (StarQuality(across.face, mesh_.vertices()[apex], mesh_.vertices()) <
            kMinPyramidQuality) {
          continue;
        }
        if (mesh_.AddCell(MakePyramid(Reversed(across.face).v, apex)) < 0) continue;
        (*done)[t] = (*done)[other] = 1;
        return;
      }
    }
  }

  // Faces of the region towards what is outside become hull.
  void MarkHullFaces(int t) {
    static constexpr int kOutwardFace[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
    const auto& tetrahedra = cover_.tetrahedra();
    for (int i = 0; i < 4; ++i) {
      const auto across = cover_.Across(t, i);
      if (across.cell >= 0 || visited_[across.tetrahedron]) continue;
      const auto& v = tetrahedra.vertices[t];
      mesh_.MarkHull(
          {3, {v[kOutwardFace[i][0]], v[kOutwardFace[i][1]], v[kOutwardFace[i][2]], -1}});
    }
  }

  // Open faces of remaining cells with nothing inside behind them lie on the hull.
  void MarkFacesTowardsOutside() {
    for (const CellFace& face : mesh_.OpenFaces()) {
      const int32_t cell = mesh_.Owner(face);
      if (cell >= static_cast<int32_t>(dying_.size()) || !cover_.IsCovered(cell)) continue;
      const int cavity = cavities_.Of(mesh_.FindHalfFace(face));
      if (cavity >= 0 && !cavity_done_[cavity]) continue;  // not ours to fill
      const Vec3d centre = FaceCentroid(face, mesh_.vertices());
      if (!hull_.queries->IsWithin(centre, kMaxHullFaceDepth) && hull_.queries->IsInside(centre)) {
        continue;
      }
      const auto behind = cover_.TetrahedraBehind(cell, face);
      if (std::none_of(behind.begin(), behind.end(), [&](int t) { return visited_[t] != 0; })) {
        mesh_.MarkHull(face);
      }
    }
  }

  const Hull& hull_;
  const Cavities& cavities_;
  const FillScope& scope_;
  WorkingMesh& mesh_;
  TetrahedralCover cover_;
  bool escaped_ = false;
  std::vector<uint8_t> in_scope_;
  std::vector<Side> side_;
  std::vector<uint8_t> visited_, behind_hull_face_, dying_, cavity_done_;
  std::vector<std::vector<int>> cells_in_;
  std::vector<int> contradictions_, pending_, pending_cells_;
};

}  // namespace

bool FillByDelaunay(const Hull& hull, const Cavities& cavities, const FillScope& scope,
                    uint64_t seed, WorkingMesh* mesh) {
  return DelaunayFiller(hull, cavities, scope, seed, mesh).Run();
}

}  // namespace amhex
