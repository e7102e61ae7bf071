// Decides which side of each closed component is solid.
#pragma once

#include <cstdint>

#include "amhex/input_hull.h"
#include "input/surface_topology.h"

namespace amhex {

struct ComponentDecision {
  int64_t turned_components = 0;       // looked the wrong way
  int64_t dropped_components = 0;      // bound nothing: flat, or solid on both sides
  double dropped_flat_area_ratio = 0;  // of the whole area, [0, 1]
  bool components_cut = false;         // some component lies partly inside another one
};

// Turns and drops components of a closed, consistently oriented surface so that its winding number
// is 1 in the solid and 0 outside, as long as components do not cut each other (else
// `components_cut` is set and none is dropped for its surroundings):
//   an outermost component looks outward;
//   a component inside it bounds a cavity if it looked inward while the outermost ones looked
//   outward (or the reverse), and is part of the solid, hence dropped, if it looked the same way;
//   a component whose triangles disagreed says nothing: then every second nesting level is hollow.
// Components that enclose less than 1e-9 of the total volume are dropped.
ComponentDecision OrientComponents(const OrientationResult& orientation, TriangleMesh& mesh,
                                   Components& components);

// The same turning, and nothing else, of those components of a soup that are closed; they may cut
// each other. Returns how many were turned. `orientation` is of the same `components`.
int64_t TurnClosedComponents(const OrientationResult& orientation, const EdgeAdjacency& adjacency,
                             const Components& components, TriangleMesh& mesh);

}  // namespace amhex
