// Stars at the hull, taken apart below other hull faces than they have: one whose apex lies on the
// hull stands where a single cell and a single face of the hull could, and the triangles of a patch
// where quadrilaterals could.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "closure/star_peeler.h"
#include "closure/working_mesh.h"

namespace amhex {

// True if the apex itself is on the hull.
bool IsAtHull(const WorkingMesh& mesh, int32_t apex, const std::vector<int>& star);

// What the cells lack to the scaled Jacobian 1, summed up.
double LossOf(const WorkingMesh& mesh, const std::vector<int>& cells);

// Cuts the part of the hull that a star has into other faces, without the vertices inside of it,
// and peels what is below in every such way; returns the one whose cells lack least, if they lack
// clearly less than `loss_to_beat`. The hull stays within a sixth of an edge length at the vertices
// that go. Nothing for stars away from the hull, and for large ones.
std::optional<StarPeeler> RecapStar(const WorkingMesh& mesh, int32_t apex,
                                    const std::vector<int>& star, StarFolds folds,
                                    double loss_to_beat);

}  // namespace amhex
