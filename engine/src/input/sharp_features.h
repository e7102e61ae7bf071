// Sharp edges and corners of the hull, and the smooth patches between them.
#pragma once

#include <cstdint>

#include "input/hull.h"
#include "input/surface_topology.h"

namespace amhex {

// Fills hull.sharp_edges, sharp_degree and patch from its vertices, triangles and normals.
//
// An edge is sharp if the normals of its triangles differ by more than `sharp_angle_degrees` and
// it belongs to a chain long enough to matter to cells of edge length 1: scans are full of short
// sharp chains that are noise, and cells bent to those are lost. Chains with a loose end and closed
// chains by themselves need a length of 2 edge lengths; what hangs together needs an extent of 2.
void FindSharpFeatures(double sharp_angle_degrees, const EdgeAdjacency& adjacency, Hull& hull);

}  // namespace amhex
