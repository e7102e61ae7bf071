// Triangles and quads as loops of three and four edges. Section 5.2, I.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "amhex/run_context.h"
#include "amhex/vec3.h"
#include "topology/edge_network.h"
#include "topology/half_face.h"

namespace amhex {

// Appends every loop of three edges once, ascending, in the direction that stands for the face.
absl::Status FindTriangles(const EdgeNetwork& network, const RunContext& context,
                           std::vector<CellFace>* triangles);

// Appends every loop of four edges without an edge across likewise. (A loop with an edge across
// is two triangles.)
absl::Status FindQuads(const EdgeNetwork& network, const RunContext& context,
                       std::vector<CellFace>* quads);

// True if every corner angle is at least pi/4 and opposite edges differ by at most pi/3 in
// direction; a quad beyond these limits is better split.
bool IsWellShapedQuad(const CellFace& quad, const std::vector<Vec3d>& vertices);

// The shorter of the quad's two diagonals, the one from v[0] if they are equal.
VertexPair ShortestDiagonal(const CellFace& quad, const std::vector<Vec3d>& vertices);

}  // namespace amhex
