// Sharp edges and corners of the hull, and the smooth patches between them.
#pragma once

#include <cstdint>
#include <vector>

#include "input/ask_hull.h"
#include "input/hull.h"
#include "input/surface_topology.h"

namespace amhex {

// Sides that meet in a ridge of less than 50 degrees have normals whose cosine is below this. A row
// of cells that ends one edge length before such a ridge is less than one edge length high there.
inline constexpr double kAcuteRidgeCosine = -0.643;

// Fills hull.sharp_edges, sharp_degree and patch from its vertices, triangles and normals.
//
// An edge is sharp if the normals of its triangles differ by more than `sharp_angle_degrees`, and
// if that matters to cells of edge length 1, for scans are full of sharp edges that are noise, and
// cells bent to those are lost:
//   some way off, on both sides of the edge, the hull's normals still differ by 0.7 of that angle;
//   the hull does not go on turning on both sides by more than half as much, as it does over the
//   facets of a coarsely tessellated round (angles above 60 degrees are sharp nevertheless);
//   the edge belongs to a chain: those with a loose end and closed ones by themselves need a length
//   of 2 edge lengths, what hangs together needs an extent of 2.
// `asker` asks hull.queries; throws as it does.
void FindSharpFeatures(double sharp_angle_degrees, const EdgeAdjacency& adjacency,
                       const HullAsker& asker, Hull& hull);

// Those of hull.sharp_edges, in their order, that cells are to follow: vertex placement keeps to
// them, and a result's deviation is measured against them. Connected sharp edges of less than 3
// edge lengths in total are noise: on scans, following them costs good cells and gains nothing.
std::vector<SharpEdge> FollowedEdges(const Hull& hull);

}  // namespace amhex
