// Where the hull crosses the rows of the lattice along x, and in which direction.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "amhex/vec3.h"
#include "input/hull.h"
#include "relax/fcc_lattice.h"

namespace amhex {

struct RowCrossing {
  int32_t row = 0;
  int32_t sign = 0;  // +1 where a row enters an outward oriented hull, -1 where it leaves
  double x = 0;      // edge lengths from the lattice's origin
};

// Row of the lattice points (*, y, z).
inline int32_t RowIndex(const FccLattice& lattice, int32_t y, int32_t z) {
  return z * lattice.tiles_y * kTileWidth + y;
}

struct ByRow {
  bool operator()(const RowCrossing& a, const RowCrossing& b) const { return a.row < b.row; }
};

// All crossings, sorted by (row, x, sign). A row that meets an edge or a vertex exactly is treated
// as shifted by an infinitesimal step, the same for all triangles, so that closed hulls have
// crossings that cancel.
//
// Errors: RESOURCE_EXHAUSTED (more crossings than any sensible hull has), CANCELLED,
// DEADLINE_EXCEEDED.
absl::StatusOr<std::vector<RowCrossing>> CrossRows(const Hull& hull, const Vec3d& origin,
                                                   const FccLattice& lattice,
                                                   const RunContext& run);

}  // namespace amhex
