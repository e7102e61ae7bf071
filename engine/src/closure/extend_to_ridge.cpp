#include "closure/extend_to_ridge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "closure/cell_contains.h"
#include "closure/fill_notches.h"
#include "closure/hull_side.h"
#include "optimize/cell_quality.h"

namespace amhex {
namespace {

// The narrow face that rows end on is this far before the edge, in edge lengths: less than what a
// boundary may miss of the hull (optimize/hull_deviation).
constexpr double kNose = 0.12;
// Faces are extended whose middle is this near, and that look at the edge (cosine).
constexpr double kReach = 5.5;
constexpr double kMinLookCosine = 0.6;
// The nearest cells are taken away up to so far from the edge. Farther off there is room for cells.
constexpr std::array<double, 6> kTakenAway = {0, 0.8, 1.4, 2.0, 2.6, 3.2};
// Rows are at least so high where they begin to be extended.
constexpr double kMinRowHeight = 0.2;
constexpr double kMinQuality = 0.1;
// Cells that closing adds for an open face (closure/rank_complexes).
constexpr double kCellsPerOpenFace = 1.8;
// Corners are tested for overlap this far towards the centre (closure/extrude_layer).
constexpr double kOverlapShrink = 0.25;
constexpr double kOverlapReach = 2.5;

Vec3d CentreOf(const WorkingMesh& mesh, int cell) {
  const CellVertices vertices = VerticesOf(mesh.corners(cell));
  Vec3d centre;
  for (const int32_t v : vertices) centre += mesh.vertices()[v];
  return centre / vertices.count;
}

// What is left to be done, in cells that will be no hexahedra.
double CostOf(const WorkingMesh& mesh) {
  double others = kCellsPerOpenFace * static_cast<double>(mesh.OpenFaces().size());
  for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
    if (mesh.alive(cell) && !mesh.is_hexahedron(cell)) others += 1;
  }
  return others;
}

// Extends the faces of one mesh to one piece of ridge.
class Extension {
 public:
  Extension(const Hull& hull, const SegmentQueries& ridge, WorkingMesh* mesh, const StopPoll& poll)
      : ridge_(ridge), mesh_(*mesh), poll_(poll), side_(hull, mesh, poll) {}

  // Returns the number of new cells.
  int Run() {
    const std::vector<CellFace> faces = FacesThatLook();
    if (faces.empty()) return 0;
    double distance = 0;
    for (const CellFace& face : faces) distance += ridge_.Closest(Middle(face), kReach).distance;
    distance /= static_cast<double>(faces.size());
    columns_ = std::max(1, static_cast<int>(std::lround(distance - kNose)));
    const int first = mesh_.cell_slots();
    for (const CellFace& face : faces) Extend(face);
    if (OverlapsOlder(first)) return 0;
    for (int cell = first; cell < mesh_.cell_slots(); ++cell) {
      side_.MarkFacesOf(cell, [](int32_t) { return true; });
    }
    for (const CellFace& nose : noses_) mesh_.MarkHull(nose);
    return mesh_.cell_slots() - first;
  }

 private:
  Vec3d Middle(const CellFace& face) const { return FaceCentroid(face, mesh_.vertices()); }

  std::vector<CellFace> FacesThatLook() const {
    std::vector<CellFace> faces;
    for (const CellFace& face : mesh_.OpenFaces()) {
      const Vec3d middle = Middle(face);
      const SegmentPoint nearest = ridge_.Closest(middle, kReach);
      if (face.count != 4 || nearest.segment < 0 || nearest.distance < kNose) continue;
      const Vec3d way = (nearest.point - middle) / nearest.distance;
      if (Dot(way, FaceUnitNormal(face, mesh_.vertices())) < kMinLookCosine) continue;
      if (HeightOf(face) >= kMinRowHeight) faces.push_back(face);
    }
    return faces;
  }

  // Of the sides of a face the two that lead from one side of the hull to the other are those
  // across the ridge's direction.
  double HeightOf(const CellFace& face) const {
    const SegmentPoint nearest = ridge_.Closest(Middle(face), kReach);
    const LineSegment& segment = ridge_.segment(nearest.segment);
    const Vec3d along = Normalized(segment.second - segment.first);
    double height = 0;
    for (int j = 0; j < 4; ++j) {
      const Vec3d edge = mesh_.vertices()[face.v[(j + 1) % 4]] - mesh_.vertices()[face.v[j]];
      height = std::max(height, Norm(edge - along * Dot(edge, along)));
    }
    return height;
  }

  // The vertices from `v` to the ridge, without itself.
  const std::vector<int32_t>& ColumnOf(int32_t v) {
    std::vector<int32_t>& column = column_of_[v];
    if (!column.empty()) return column;
    const Vec3d from = mesh_.vertices()[v];
    const SegmentPoint nearest = ridge_.Closest(from, 2 * kReach);
    const Vec3d to = nearest.point + (from - nearest.point) * (kNose / nearest.distance);
    const bool on_hull = side_.Holds(v);
    for (int k = 1; k <= columns_; ++k) {
      const double part = static_cast<double>(k) / columns_;
      column.push_back(mesh_.AddVertex(from + (to - from) * part));
      if (on_hull) side_.Add(column.back());
    }
    return column;
  }

  void Extend(const CellFace& face) {
    CellFace base = face;
    for (int k = 0; k < columns_; ++k) {
      CellFace top = base;
      for (int j = 0; j < 4; ++j) top.v[j] = ColumnOf(face.v[j])[k];
      const CellCorners corners = {base.v[0], base.v[1], base.v[2], base.v[3],
                                   top.v[0],  top.v[1],  top.v[2],  top.v[3]};
      if (CellQuality(corners, mesh_.vertices()) < kMinQuality || mesh_.AddCell(corners) < 0)
        return;
      base = top;
    }
    noses_.push_back(base);
  }

  // True if a cell from `first` on reaches into one before it, or one of those into it.
  bool OverlapsOlder(int first) const {
    std::vector<int> older;
    for (int cell = 0; cell < first; ++cell) {
      if (!mesh_.alive(cell)) continue;
      if (ridge_.Closest(CentreOf(mesh_, cell), kReach + kOverlapReach).segment >= 0) {
        older.push_back(cell);
      }
    }
    for (int cell = first; cell < mesh_.cell_slots(); ++cell) {
      poll_.Now();
      const Vec3d centre = CentreOf(mesh_, cell);
      for (const int other : older) {
        if (Norm(CentreOf(mesh_, other) - centre) > kOverlapReach) continue;
        if (ReachesInto(cell, other) || ReachesInto(other, cell)) return true;
      }
    }
    return false;
  }

  bool ReachesInto(int cell, int other) const {
    const auto& x = mesh_.vertices();
    const Vec3d centre = CentreOf(mesh_, cell);
    if (CellContains(mesh_.corners(other), x, centre)) return true;
    const CellVertices vertices = VerticesOf(mesh_.corners(cell));
    return std::any_of(vertices.begin(), vertices.end(), [&](int32_t v) {
      return CellContains(mesh_.corners(other), x, x[v] + (centre - x[v]) * kOverlapShrink);
    });
  }

  const SegmentQueries& ridge_;
  WorkingMesh& mesh_;
  const StopPoll poll_;
  HullSide side_;
  int columns_ = 1;
  std::map<int32_t, std::vector<int32_t>> column_of_;
  std::vector<CellFace> noses_;
};

void TakeAway(const SegmentQueries& ridge, double distance, WorkingMesh* mesh) {
  if (distance == 0) return;
  for (int cell = 0; cell < mesh->cell_slots(); ++cell) {
    if (!mesh->alive(cell)) continue;
    if (ridge.Closest(CentreOf(*mesh, cell), distance).segment >= 0) mesh->RemoveCell(cell);
  }
}

bool HasOpenFacesNear(const SegmentQueries& ridge, const WorkingMesh& mesh) {
  const std::vector<CellFace> open = mesh.OpenFaces();
  return std::any_of(open.begin(), open.end(), [&](const CellFace& face) {
    return ridge.Closest(FaceCentroid(face, mesh.vertices()), kReach).segment >= 0;
  });
}

}  // namespace

int ExtendToRidges(const Hull& hull, const std::vector<SegmentQueries>& ridges, WorkingMesh* mesh,
                   const StopPoll& poll) {
  int changed = 0;
  for (const SegmentQueries& ridge : ridges) {
    if (!HasOpenFacesNear(ridge, *mesh)) continue;
    double least = CostOf(*mesh);
    const WorkingMesh before = *mesh;
    bool is_better = false;
    for (const double distance : kTakenAway) {
      poll.Now();
      WorkingMesh tried = before;
      TakeAway(ridge, distance, &tried);
      if (Extension(hull, ridge, &tried, poll).Run() == 0) continue;
      FillNotches(hull, &tried, poll);
      const double cost = CostOf(tried);
      if (cost >= least) continue;
      least = cost;
      *mesh = std::move(tried);
      is_better = true;
    }
    changed += is_better ? 1 : 0;
  }
  return changed;
}

}  // namespace amhex
