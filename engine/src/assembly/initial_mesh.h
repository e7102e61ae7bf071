// The mesh that listing 3 starts from: the initial primitives without their conflicts.
#pragma once

#include <cstdint>
#include <vector>

#include "assembly/open_faces.h"
#include "topology/primitive_table.h"

namespace amhex {

// [primitive_count] 1 for the initial primitives that stay. Of primitives that claim the same
// half-face the larger type stays, then the higher quality, then the lower index. `open_faces`
// must be empty and holds the chosen ones afterwards. Linear but for sorting the conflicts.
std::vector<uint8_t> ChooseInitialMesh(const PrimitiveTable& table, OpenFaces* open_faces);

}  // namespace amhex
