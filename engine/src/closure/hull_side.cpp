#include "closure/hull_side.h"

#include "input/hull_queries.h"

namespace amhex {
namespace {

// A vertex this near is on the hull (closure/extrude_layer), a face whose middle is this near and
// whose normal is this near the hull's (cosine) as well.
constexpr double kSideOnHullDistance = 0.12;
constexpr double kMaxMiddleDistance = 0.35;
constexpr double kSideNormalCosine = 0.5;

}  // namespace

HullSide::HullSide(const Hull& hull, WorkingMesh* mesh, const StopPoll& poll)
    : hull_(hull), mesh_(*mesh), on_hull_(mesh->vertices().size(), 0) {
  for (int cell = 0; cell < mesh_.cell_slots(); ++cell) {
    poll.At(cell);
    if (!mesh_.alive(cell)) continue;
    mesh_.VisitHullFaces(cell, [this](const CellFace& face) {
      for (int j = 0; j < face.count; ++j) on_hull_[face.v[j]] = 1;
    });
  }
}

bool HullSide::Holds(int32_t vertex) const {
  if (static_cast<size_t>(vertex) < on_hull_.size() && on_hull_[vertex] != 0) return true;
  return hull_.queries->Closest(mesh_.vertices()[vertex], kSideOnHullDistance).triangle >= 0;
}

void HullSide::Add(int32_t vertex) {
  if (static_cast<size_t>(vertex) >= on_hull_.size()) on_hull_.resize(vertex + 1, 0);
  on_hull_[vertex] = 1;
}

bool HullSide::Holds(const CellFace& outward) const {
  for (int j = 0; j < outward.count; ++j) {
    if (!Holds(outward.v[j])) return false;
  }
  const HullPoint nearest =
      hull_.queries->Closest(FaceCentroid(outward, mesh_.vertices()), kMaxMiddleDistance);
  return nearest.triangle >= 0 &&
         Dot(FaceUnitNormal(outward, mesh_.vertices()), nearest.normal) > kSideNormalCosine;
}

}  // namespace amhex
