// How the triangles of a surface hang together: neighbours, orientation, components, openings.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "amhex/input_hull.h"
#include "base/stop_poll.h"

namespace amhex {

// A half-edge is numbered 3 * triangle + corner and runs from that corner to the next one.
using HalfEdgeId = int32_t;
inline constexpr HalfEdgeId kOpenEdge = -1;         // the edge has one triangle
inline constexpr HalfEdgeId kNonManifoldEdge = -2;  // the edge has more than two

struct EdgeAdjacency {
  // [3 * triangle_count] the other half-edge on the same edge, or one of the two marks above.
  std::vector<HalfEdgeId> opposite;
  int64_t open_edge_count = 0;
  int64_t non_manifold_edge_count = 0;  // edges with more than two triangles
  int64_t edge_count = 0;

  bool IsClosedManifold() const { return open_edge_count == 0 && non_manifold_edge_count == 0; }
};

// Triangles must have three different corners. Linear in the triangles but for vertices with very
// many of them. Orientation plays no part.
EdgeAdjacency FindEdgeAdjacency(const TriangleMesh& mesh, const StopPoll& poll = {});

// Edge-connected components.
struct Components {
  std::vector<int32_t> of_triangle;  // [triangle_count] numbered by their first triangle
  int32_t count = 0;
};
Components FindComponents(const EdgeAdjacency& adjacency, const StopPoll& poll = {});

// Turns triangles so that neighbours agree, as few as possible in each component.
struct OrientationResult {
  bool is_orientable = true;              // false: some component has no two sides; mesh unchanged
  std::vector<uint8_t> was_inconsistent;  // [component_count] some but not all were turned
  int64_t turned_count = 0;
};
OrientationResult MakeOrientationConsistent(const EdgeAdjacency& adjacency,
                                            const Components& components, TriangleMesh& mesh,
                                            const StopPoll& poll = {});

// Gives every fan of triangles around a vertex a vertex of its own, so that surfaces which touch
// in a point come apart there. Returns the number of vertices added.
int64_t SplitFans(const EdgeAdjacency& adjacency, TriangleMesh& mesh, const StopPoll& poll = {});

// Where more than two triangles share an edge: drops the sheets (pieces cut out along such edges)
// that end in the open, if what stays then is closed. Returns the number of sheets dropped; 0, with
// `mesh` unchanged, if that does not help.
int64_t DropLooseSheets(const EdgeAdjacency& adjacency, TriangleMesh& mesh);

// Boundary loops of a consistently oriented surface whose vertices have one fan each: vertex ids
// in the direction of a patch that fills the loop.
std::vector<std::vector<int32_t>> FindOpenings(const EdgeAdjacency& adjacency,
                                               const TriangleMesh& mesh);

// Sum of the components' genera; for closed manifold surfaces.
int64_t GenusOf(const TriangleMesh& mesh, const EdgeAdjacency& adjacency,
                const Components& components);

// Drops vertices that no triangle uses; returns how many.
int64_t DropUnusedVertices(TriangleMesh& mesh, const StopPoll& poll = {});

// Signed volume per component: positive where outward. [component_count]
std::vector<double> ComponentVolumes(const TriangleMesh& mesh, const Components& components);

}  // namespace amhex
