// The law of an at-most-hexa mesh, as a client checks it on what it received.
#pragma once

#include "absl/status/status.h"
#include "amhex/volume_mesh.h"

namespace amhex::client {

// OK if: the arrays' lengths agree and are not zero; every vertex is finite and every corner names
// one; every cell has the faces of its stated type and a positive volume; every face belongs to
// one cell or, turned around, to two; and every edge of the boundary is passed once in each
// direction per pair, so that the boundary is closed.
// DATA_LOSS naming the first offender. O(n) time and memory.
absl::Status CheckMesh(const AtMostHexaMesh& mesh);

}  // namespace amhex::client
