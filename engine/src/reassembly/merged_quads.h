// Quads that two triangles of a volume mesh form together.
#pragma once

#include <vector>

#include "reassembly/break_down.h"

namespace amhex {

// Which two triangles are a quad. In degrees.
struct QuadLimits {
  double corner = 0;      // every angle between this and 180 less this
  double inner_fold = 0;  // between the triangles, inside
  double hull_fold = 0;   // and on the hull, whose shape a bent quad changes
};

// Where the cells stay as they are. Between the paper's limit for good hexahedra, 45 degrees, and
// what a scaled Jacobian of 0.1 would permit; 20 and 70 degrees take three times as long and find
// half as many hexahedra again.
inline constexpr QuadLimits kQuadsOfVolumes{30, 60, 15};

// Every pair of triangles over a common edge that makes a quad within the limits; both on the hull
// or both inside. Triangles of hexahedra there are none; those of all other cells
// count. Ascending, each once, in the direction that stands for the face. O(n log n).
std::vector<CellFace> FindMergedQuads(const BrokenVolume& volume, const QuadLimits& limits);

}  // namespace amhex
