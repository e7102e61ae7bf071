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
#include "fields/point_index.h"
#include "optimize/cell_quality.h"

namespace amhex {
namespace {

// The narrow face that rows end on is this far before an edge, in edge lengths: less than what a
// boundary may miss of the hull (optimize/hull_deviation).
constexpr double kNose = 0.12;
// Faces are extended whose middle is this near, at a tip farther if it is narrow for longer, and
// that look at the edge or tip (cosine).
constexpr double kReach = 5.5;
constexpr double kMinLookCosine = 0.6;
// The nearest cells are taken away up to so far from the edge, at a tip farther by the same share.
// Beyond that there is room for cells.
constexpr std::array<double, 9> kTakenAway = {0, 0.8, 1.4, 2.0, 2.6, 3.2, 3.8, 4.4, 5.0};
// What stands out of the wall that is left goes as well, in so many rounds and up to so much
// farther.
constexpr std::array<int, 3> kLevellings = {0, 1, 2};
constexpr double kLevelled = 1.2;
// Rows are at least so high where they begin to be extended.
constexpr double kMinRowHeight = 0.2;
constexpr double kMinRidgeQuality = 0.1;
// Cells that closing adds for an open face (closure/rank_complexes).
constexpr double kCellsPerOpenFace = 1.8;
// Corners are tested for overlap this far towards the centre (closure/extrude_layer).
constexpr double kOverlapShrink = 0.25;
constexpr double kOverlapReach = 2.5;

// A tip is an edge as short as this, in edge lengths, which ends in it from outside.
constexpr double kTipLength = 0.01;

// What cells are extended to.
struct AcuteEnd {
  const SegmentQueries& line;
  double reach;
  double nose;       // cells end so far before it
  bool has_notches;  // of layers that end between its sides
};

// What is left to be done, in cells that will be no hexahedra.
double CostOf(const WorkingMesh& mesh) {
  double others = kCellsPerOpenFace * static_cast<double>(mesh.OpenFaces().size());
  for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
    if (mesh.alive(cell) && !mesh.is_hexahedron(cell)) others += 1;
  }
  return others;
}

int CountOpen(const WorkingMesh& mesh, int cell) {
  const WorkingMesh::HalfFaces& halves = mesh.half_faces(cell);
  return static_cast<int>(std::count_if(halves.begin(), halves.end(), [&](int32_t half) {
    return half >= 0 && mesh.owner(half ^ 1) == WorkingMesh::kOpen;
  }));
}

// Extends the faces of one mesh to one end.
class Extension {
 public:
  Extension(const Hull& hull, const AcuteEnd& end, WorkingMesh* mesh, const StopPoll& poll)
      : ridge_(end.line),
        reach_(end.reach),
        nose_(end.nose),
        mesh_(*mesh),
        poll_(poll),
        side_(hull, mesh, poll) {}

  // Returns the number of new cells.
  int Run() {
    const std::vector<CellFace> faces = FacesThatLook();
    if (faces.empty()) return 0;
    double distance = 0;
    for (const CellFace& face : faces) distance += ridge_.Closest(Middle(face), reach_).distance;
    distance /= static_cast<double>(faces.size());
    columns_ = std::max(1, static_cast<int>(std::lround(distance - nose_)));
    const int first = mesh_.cell_slots();
    for (const CellFace& face : faces) Extend(face);
    DropOverlapping(first);
    int added = 0;
    for (const Row& row : rows_) {
      for (const int cell : row.cells) side_.MarkFacesOf(cell, [](int32_t) { return true; });
      if (!row.cells.empty()) mesh_.MarkHull(row.nose);
      added += static_cast<int>(row.cells.size());
    }
    return added;
  }

  // True if the tip is filled in part only. What is left of it would become poor cells: stars need
  // room.
  bool LeavesSidesOpen() const {
    return std::any_of(rows_.begin(), rows_.end(), [&](const Row& row) {
      return std::any_of(row.cells.begin(), row.cells.end(),
                         [&](int cell) { return CountOpen(mesh_, cell) > 0; });
    });
  }

 private:
  // The cells before one face of the wall, and the narrow face that they end on.
  struct Row {
    std::vector<int> cells;
    CellFace nose;
  };

  // Cells that were there before, and their centres.
  struct Older {
    std::vector<int> cells;
    std::vector<Vec3d> centres;
  };

  Vec3d Middle(const CellFace& face) const { return FaceCentroid(face, mesh_.vertices()); }

  std::vector<CellFace> FacesThatLook() const {
    std::vector<CellFace> faces;
    for (const CellFace& face : mesh_.OpenFaces()) {
      const Vec3d middle = Middle(face);
      const SegmentPoint nearest = ridge_.Closest(middle, reach_);
      if (face.count != 4 || nearest.segment < 0 || nearest.distance < nose_) continue;
      const Vec3d way = (nearest.point - middle) / nearest.distance;
      if (Dot(way, FaceUnitNormal(face, mesh_.vertices())) < kMinLookCosine) continue;
      if (HeightOf(face) >= kMinRowHeight) faces.push_back(face);
    }
    return faces;
  }

  // Of the sides of a face the two that lead from one side of the hull to the other are those
  // across the ridge's direction.
  double HeightOf(const CellFace& face) const {
    const SegmentPoint nearest = ridge_.Closest(Middle(face), reach_);
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
    const SegmentPoint nearest = ridge_.Closest(from, 2 * reach_);
    const Vec3d to = nearest.point + (from - nearest.point) * (nose_ / nearest.distance);
    const bool on_hull = side_.Holds(v);
    for (int k = 1; k <= columns_; ++k) {
      const double part = static_cast<double>(k) / columns_;
      column.push_back(mesh_.AddVertex(from + (to - from) * part));
      if (on_hull) side_.Add(column.back());
    }
    return column;
  }

  // The cells before one face; all of them or none.
  void Extend(const CellFace& face) {
    Row row;
    CellFace base = face;
    for (int k = 0; k < columns_; ++k) {
      CellFace top = base;
      for (int j = 0; j < 4; ++j) top.v[j] = ColumnOf(face.v[j])[k];
      const CellCorners corners = {base.v[0], base.v[1], base.v[2], base.v[3],
                                   top.v[0],  top.v[1],  top.v[2],  top.v[3]};
      const bool is_good = CellQuality(corners, mesh_.vertices()) >= kMinRidgeQuality;
      const int cell = is_good ? mesh_.AddCell(corners) : -1;
      if (cell < 0) {
        Drop(row);
        return;
      }
      row.cells.push_back(cell);
      base = top;
    }
    row.nose = base;
    rows_.push_back(std::move(row));
  }

  void Drop(Row& row) {
    for (const int cell : row.cells) mesh_.RemoveCell(cell);
    row.cells.clear();
  }

  // Of rows that reach into cells before `first`, or those into them.
  void DropOverlapping(int first) {
    Older older;
    for (int cell = 0; cell < first; ++cell) {
      if (!mesh_.alive(cell)) continue;
      const Vec3d centre = CellCentroid(mesh_.corners(cell), mesh_.vertices());
      if (ridge_.Closest(centre, reach_ + kOverlapReach).segment < 0) continue;
      older.cells.push_back(cell);
      older.centres.push_back(centre);
    }
    const fields::PointIndex index(older.centres, kOverlapReach);
    for (Row& row : rows_) {
      poll_.Now();
      if (std::any_of(row.cells.begin(), row.cells.end(),
                      [&](int cell) { return Overlaps(cell, older, index); })) {
        Drop(row);
      }
    }
  }

  bool Overlaps(int cell, const Older& older, const fields::PointIndex& index) const {
    const Vec3d centre = CellCentroid(mesh_.corners(cell), mesh_.vertices());
    bool any = false;
    index.VisitNear(centre, kOverlapReach, [&](int32_t i) {
      if (any || Norm(older.centres[i] - centre) > kOverlapReach) return;
      any = ReachesInto(cell, older.cells[i]) || ReachesInto(older.cells[i], cell);
    });
    return any;
  }

  bool ReachesInto(int cell, int other) const {
    const auto& x = mesh_.vertices();
    const Vec3d centre = CellCentroid(mesh_.corners(cell), mesh_.vertices());
    if (CellContains(mesh_.corners(other), x, centre)) return true;
    const CellVertices vertices = VerticesOf(mesh_.corners(cell));
    return std::any_of(vertices.begin(), vertices.end(), [&](int32_t v) {
      return CellContains(mesh_.corners(other), x, x[v] + (centre - x[v]) * kOverlapShrink);
    });
  }

  const SegmentQueries& ridge_;
  const double reach_;
  const double nose_;
  WorkingMesh& mesh_;
  const StopPoll poll_;
  HullSide side_;
  int columns_ = 1;
  std::map<int32_t, std::vector<int32_t>> column_of_;
  std::vector<Row> rows_;
};

// Cells that are no hexahedra beside the wall, or that stand out of it.
bool IsRagged(const WorkingMesh& mesh, int cell) {
  const int open = CountOpen(mesh, cell);
  return open > 1 || (open == 1 && !mesh.is_hexahedron(cell));
}

void TakeAway(const SegmentQueries& ridge, double distance, int levellings, WorkingMesh* mesh) {
  if (distance == 0) return;
  for (int cell = 0; cell < mesh->cell_slots(); ++cell) {
    if (!mesh->alive(cell)) continue;
    if (ridge.Closest(CellCentroid(mesh->corners(cell), mesh->vertices()), distance).segment >= 0)
      mesh->RemoveCell(cell);
  }
  for (int round = 0; round < levellings; ++round) {
    std::vector<int> ragged;
    for (int cell = 0; cell < mesh->cell_slots(); ++cell) {
      if (!mesh->alive(cell) || !IsRagged(*mesh, cell)) continue;
      if (ridge.Closest(CellCentroid(mesh->corners(cell), mesh->vertices()), distance + kLevelled)
              .segment >= 0)
        ragged.push_back(cell);
    }
    for (const int cell : ragged) mesh->RemoveCell(cell);
  }
}

bool HasOpenFacesNear(const AcuteEnd& end, const WorkingMesh& mesh) {
  const std::vector<CellFace> open = mesh.OpenFaces();
  return std::any_of(open.begin(), open.end(), [&](const CellFace& face) {
    return end.line.Closest(FaceCentroid(face, mesh.vertices()), end.reach).segment >= 0;
  });
}

// True if its cells have changed.
bool ExtendTo(const Hull& hull, const AcuteEnd& end, WorkingMesh* mesh, const StopPoll& poll) {
  if (!HasOpenFacesNear(end, *mesh)) return false;
  double least = CostOf(*mesh);
  const WorkingMesh before = *mesh;
  bool is_better = false;
  for (const double distance : kTakenAway) {
    for (const int levellings : kLevellings) {
      if (distance == 0 && levellings > 0) break;  // nothing is taken away
      poll.Now();
      WorkingMesh tried = before;
      TakeAway(end.line, distance * end.reach / kReach, levellings, &tried);
      Extension extension(hull, end, &tried, poll);
      if (extension.Run() == 0) continue;
      if (end.has_notches) FillNotches(hull, &tried, poll);
      if (extension.LeavesSidesOpen()) continue;
      const double cost = CostOf(tried);
      if (cost >= least) continue;
      least = cost;
      *mesh = std::move(tried);
      is_better = true;
    }
  }
  return is_better;
}

}  // namespace

int ExtendToRidges(const Hull& hull, const std::vector<SegmentQueries>& ridges, WorkingMesh* mesh,
                   const StopPoll& poll) {
  int changed = 0;
  for (const SegmentQueries& ridge : ridges) {
    changed += ExtendTo(hull, {ridge, kReach, kNose, true}, mesh, poll) ? 1 : 0;
  }
  return changed;
}

int ExtendToTips(const Hull& hull, const std::vector<AcuteTip>& tips, WorkingMesh* mesh,
                 const StopPoll& poll) {
  int changed = 0;
  for (const AcuteTip& tip : tips) {
    const SegmentQueries line({{tip.apex, tip.apex + tip.outward * kTipLength}});
    const AcuteEnd end{line, std::max(kReach, tip.narrow), tip.blunted, false};
    changed += ExtendTo(hull, end, mesh, poll) ? 1 : 0;
  }
  return changed;
}

}  // namespace amhex
