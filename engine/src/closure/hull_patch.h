// A patch of triangles and quads that closes a loop on the hull, seen from a star's apex.
#pragma once

#include <optional>
#include <vector>

#include "closure/working_mesh.h"
#include "input/hull.h"

namespace amhex {

struct HullPatch {
  std::vector<CellFace> faces;  // looking into the cavity
  double cost = 0;
};

// The cheapest polygonisation of `loop` by dynamic programming: one per face, plus penalties for
// poor cells towards `apex`, for chords off the hull and for folded quads. nullopt if there is
// none with positive cells. Chords that cells outside `absorbed` have as an edge already are
// refused: the mesh would touch itself there. O(n^4) in the loop's length n, which is bounded.
std::optional<HullPatch> FindHullPatch(const WorkingMesh& mesh, const Hull& hull,
                                       const std::vector<int>& absorbed,
                                       const std::vector<int32_t>& loop, const Vec3d& apex);

}  // namespace amhex
