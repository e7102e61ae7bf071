// Does the mesh cover any place twice? Winding numbers of its boundary tell.
//
// A closed conforming complex of positive cells covers a point as often as the boundary winds
// around it. Once at every cell means no overlap; once just inside and never just outside of every
// boundary face, and never just outside of every boundary edge, means that no sheet of the boundary
// dips into, or touches, another part of the mesh.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "amhex/vec3.h"
#include "amhex/volume_mesh.h"
#include "base/stop_poll.h"
#include "output/mesh_faces.h"

namespace amhex {

class DeviceUse;

struct OverlapReport {
  int64_t cell_samples = 0;
  int64_t overlapped_cells = 0;  // samples around which the boundary does not wind exactly once
  int64_t face_samples = 0;
  int64_t overlapped_faces = 0;  // samples not covered once inside and never outside
  int64_t edge_samples = 0;
  int64_t overlapped_edges = 0;  // samples covered just outside of a boundary edge
  double worst_cell_winding_error = 0;

  bool Any() const { return overlapped_cells + overlapped_faces + overlapped_edges > 0; }
};

// Requires a closed manifold boundary. At most ~20,000 cells and ~200,000 boundary faces and edges
// each are sampled, evenly by index, on `device` unless it is null. O((samples + faces) log faces).
// Throws RunStopped when `poll` does, StatusError when the device fails.
OverlapReport MeasureOverlap(const std::vector<CellCorners>& cells,
                             const std::vector<BoundaryFace>& boundary,
                             const std::vector<Vec3d>& vertices, const StopPoll& poll = {},
                             DeviceUse* device = nullptr);

// The boundary as triangles; a quad becomes four around its centre, which lies on the cell's
// bilinear face.
struct BoundaryTriangles {
  std::vector<Vec3d> vertices;                    // those on the boundary, then quad centres
  std::vector<std::array<int32_t, 3>> triangles;  // outward
};
BoundaryTriangles TriangulateBoundary(const std::vector<BoundaryFace>& boundary,
                                      const std::vector<Vec3d>& vertices);

}  // namespace amhex
