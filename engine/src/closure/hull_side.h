// Which vertices and faces of a mesh under repair lie on the hull.
#pragma once

#include <cstdint>
#include <vector>

#include "base/stop_poll.h"
#include "closure/working_mesh.h"
#include "input/hull.h"

namespace amhex {

class HullSide {
 public:
  // `mesh` must outlive this; vertices that it gains later are asked for their distance.
  HullSide(const Hull& hull, WorkingMesh* mesh, const StopPoll& poll);

  // On a hull face, or as near to the hull as one.
  bool Holds(int32_t vertex) const;
  void Add(int32_t vertex);
  // True if all its vertices are on the hull, and the hull at its middle looks its way.
  bool Holds(const CellFace& outward) const;

  // Marks those of the cell's faces as hull that lie there and have nothing behind them. Returns
  // what the cell has changed the number of open faces by: one less for each face that it shares
  // with a cell before which `is_new` does not hold, one more for each that stays open.
  template <class IsNew>
  int MarkFacesOf(int cell, const IsNew& is_new) {
    int change = 0;
    for (const CellFace& face : FacesOf(mesh_.corners(cell))) {
      const int32_t behind = mesh_.Across(face);
      if (behind >= 0) {
        change -= is_new(behind) ? 0 : 1;
      } else if (behind != WorkingMesh::kHull) {
        if (Holds(face)) {
          mesh_.MarkHull(face);
        } else {
          ++change;
        }
      }
    }
    return change;
  }

 private:
  const Hull& hull_;
  WorkingMesh& mesh_;
  std::vector<uint8_t> on_hull_;  // [vertex]
};

}  // namespace amhex
