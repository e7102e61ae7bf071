// Quads that two triangles of a volume mesh form together.
#pragma once

#include <vector>

#include "reassembly/break_down.h"

namespace amhex {

// Every pair of triangles over a common edge that makes a quad of fair angles, nearly plane; both
// on the hull or both inside. Triangles of hexahedra there are none; those of all other cells
// count. Ascending, each once, in the direction that stands for the face. O(n log n).
std::vector<CellFace> FindMergedQuads(const BrokenVolume& volume);

}  // namespace amhex
