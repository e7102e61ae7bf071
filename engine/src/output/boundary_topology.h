// The mesh boundary as a surface: is it closed and manifold, how many components, which genus.
#pragma once

#include <cstdint>
#include <vector>

#include "amhex/vec3.h"
#include "base/stop_poll.h"
#include "output/mesh_faces.h"

namespace amhex {

struct BoundaryTopology {
  int64_t edge_count = 0;
  int64_t vertex_count = 0;
  int64_t open_edge_count = 0;            // used by one boundary face only: the boundary has a rim
  int64_t non_manifold_edge_count = 0;    // used by more than two, or twice in the same direction
  int64_t non_manifold_vertex_count = 0;  // where two or more sheets of the boundary touch
  int64_t component_count = 0;
  int64_t genus = 0;  // summed over components; meaningful where all is manifold
  // Closed components that enclose next to nothing: slits left between cells.
  int64_t flat_pocket_count = 0;
  // Pairs of boundary faces that face each other across a slit and share three or more vertices:
  // a quad against triangles, or two quads on three common vertices with next to nothing between.
  int64_t hanging_face_count = 0;

  bool IsClosedManifold() const {
    return open_edge_count == 0 && non_manifold_edge_count == 0 && non_manifold_vertex_count == 0;
  }
};

// Linear in the number of boundary faces.
BoundaryTopology ExamineBoundary(const std::vector<BoundaryFace>& boundary,
                                 const std::vector<Vec3d>& vertices, const StopPoll& poll = {});

// Six times the signed volume of the cone from the origin to the face; a quad counts as the
// bilinear patch, whose volume is the mean of its two triangulations'.
double SixfoldConeVolume(const OutwardFace& face, const std::vector<Vec3d>& vertices,
                         const Vec3d& origin);

// Area vector of the face: outward normal times area (of the quad's mean plane).
Vec3d AreaVector(const OutwardFace& face, const std::vector<Vec3d>& vertices);

// Vertex average.
Vec3d FaceCentre(const OutwardFace& face, const std::vector<Vec3d>& vertices);

}  // namespace amhex
