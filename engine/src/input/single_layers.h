// Walls that hold one layer of cells, however thick: their number of cells goes with their area.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "amhex/vec3.h"
#include "base/stop_poll.h"
#include "input/hull_queries.h"

namespace amhex {

// Of a solid and an edge length h: walls with parallel sides, of 0.5 h to 1.5 h.
struct SingleLayers {
  double area = 0;    // halfway between the sides; makes area / h^2 cells
  double volume = 0;  // area times thickness
  // Of all of them; how far h may change before some have no layer, or two.
  double thinnest = 0;
  double thickest = 0;

  // By how many cells of edge length h they exceed volume / h^3.
  double ExcessCells(double h) const { return (area - volume / h) / (h * h); }
};

// A closed surface and what it encloses. Does not own.
struct SurfaceOfSolid {
  const std::vector<Vec3d>& vertices;
  const std::vector<std::array<int32_t, 3>>& triangles;
  double volume = 0;
};

// Nothing where the solid is thicker than two edge lengths on average: what walls it has then are
// too small a part of it. Otherwise the hull is asked at some thousand points, which are the same
// for the same triangles.
SingleLayers FindSingleLayers(const SurfaceOfSolid& solid, const HullQueries& queries,
                              double edge_length, const StopPoll& poll);

// What of a solid is too thin for any cell: less than 0.5 h to the other side, parallel or not.
struct ThinPart {
  double area_ratio = 0;  // of the surface
  double thickness = 0;   // the median of it
  double thinnest = 0;    // but for a tenth of it, as edges and noise are thinner anyhow
  Vec3d place;            // between the sides where it is as thick as the median
};

// The hull is asked at the same points, however thick the solid is.
ThinPart FindThinPart(const SurfaceOfSolid& solid, const HullQueries& queries, double edge_length,
                      const StopPoll& poll);

// The longest edge length for which a wall that thick has a layer of cells.
double LongestEdgeFor(double thickness);

// Whether it would pay to ask: the solid's mean thickness, 2 volume / area, is low enough.
bool MayHaveSingleLayers(const SurfaceOfSolid& solid, double edge_length);

// The edge length at which these walls and the rest of the solid together have as many cells as
// volume / edge_length^3 says, or as near to that as leaves each wall its one layer. `edge_length`
// itself where that already is within 12 %.
double EdgeLengthWithLayers(const SingleLayers& walls, double volume, double edge_length);

}  // namespace amhex
