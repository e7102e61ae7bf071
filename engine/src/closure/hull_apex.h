// Stars whose apex lies on the hull: over a cavity that ends there, every wall is joined to one
// point of the hull. No patch needs cells of its own, and a cavity one cell deep is seen from twice
// as far as by an apex in its middle.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "closure/working_mesh.h"
#include "input/hull.h"

namespace amhex {

struct HullApex {
  Vec3d point;
  double quality = 0;  // least scaled Jacobian of the cells between the walls and the apex
};

// The best point of the hull, found from the one next to `start` on, for an apex over `walls`
// (looking in) that leave the one boundary `loop` open (cavities.h). nullopt if there is none with
// positive cells around which the loop runs once, and whose triangles with the loop's edges look
// the hull's way.
std::optional<HullApex> FindHullApex(const WorkingMesh& mesh, const Hull& hull,
                                     const std::vector<CellFace>& walls,
                                     const std::vector<int32_t>& loop, const Vec3d& start);

}  // namespace amhex
