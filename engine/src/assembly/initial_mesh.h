// The mesh that listing 3 starts from: the initial primitives without their conflicts.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "assembly/conflict.h"
#include "assembly/open_faces.h"
#include "topology/primitive_table.h"

namespace amhex {

// True if primitive `a` has priority over `b`: larger type, then higher quality, then lower index.
bool HasPriority(const PrimitiveTable& table, int32_t a, int32_t b);

// Adds the initial primitives to `open_faces`, which must be empty. Of those that claim the same
// half-face only the one with priority is added. Linear but for sorting the conflicts.
void AddWithoutSharedHalfFaces(const PrimitiveTable& table, OpenFaces* open_faces);

// Removes from the mesh, which `conflicts` must know too, primitives that overlap others: of the
// conflict-pairs, those without priority, until no pair is left. Looks at the primitives with
// open faces only: where every face is matched an overlap cannot begin.
absl::Status RemoveOverlaps(const PrimitiveTable& table, const RunContext& context,
                            OpenFaces* open_faces, ConflictFinder* conflicts);

}  // namespace amhex
