// The face-centred cubic lattice on which the Voronoi diagram is computed (section 4.1).
//
// Integer coordinates (x, y, z) with even x + y + z; position = coordinates * spacing, so one
// point stands for the volume 2 * spacing^3. The lattice is cut into tiles of 8^3 coordinates (256
// points), each of 2^3 blocks of 4^3 coordinates (32 points: one machine word, one warp):
//
//   point p of a block, p = z1 z0 y1 y0 x1 (bits 4..0):  x = 2 * x1 + ((y + z) & 1)
//   block b of a tile,  b = z y x (bits 2..0), each selecting the lower or upper half
#pragma once

#include <cstdint>

#include "amhex/vec3.h"
#include "base/platform.h"

namespace amhex {

inline constexpr int kTileWidth = 8;  // coordinates
inline constexpr int kTileBlocks = 8;
inline constexpr int kBlockWidth = 4;  // coordinates
inline constexpr int kBlockPoints = 32;
inline constexpr int kTilePoints = kTileBlocks * kBlockPoints;

struct LatticePoint {
  int32_t x = 0, y = 0, z = 0;
};

// Coordinates of point `p` within its block.
AMHEX_HD constexpr LatticePoint PointInBlock(int p) {
  const int y = (p >> 1) & 3;
  const int z = (p >> 3) & 3;
  return {2 * (p & 1) + ((y + z) & 1), y, z};
}

// The inverse: which point of its block a lattice point with coordinates 0..3 is.
AMHEX_HD constexpr int IndexInBlock(const LatticePoint& q) {
  return (q.z << 3) | (q.y << 1) | (q.x >> 1);
}

// Half the width of the cubes that just hold the points of a block and of a tile.
inline constexpr float kBlockHalfWidth = 0.5f * (kBlockWidth - 1);
inline constexpr float kTileHalfWidth = 0.5f * (kTileWidth - 1);

// From the centre of its block to point `p`.
AMHEX_HD constexpr Vec3f StepFromCentre(int p) {
  const LatticePoint q = PointInBlock(p);
  return {static_cast<float>(q.x) - kBlockHalfWidth, static_cast<float>(q.y) - kBlockHalfWidth,
          static_cast<float>(q.z) - kBlockHalfWidth};
}

// The centre of the cube of this half width whose first corner is at `base`.
AMHEX_HD constexpr Vec3f CentreOfCube(const LatticePoint& base, float half_width) {
  return {static_cast<float>(base.x) + half_width, static_cast<float>(base.y) + half_width,
          static_cast<float>(base.z) + half_width};
}

// First coordinates of block `b` within its tile.
AMHEX_HD constexpr LatticePoint BlockInTile(int b) {
  return {kBlockWidth * (b & 1), kBlockWidth * ((b >> 1) & 1), kBlockWidth * ((b >> 2) & 1)};
}

struct FccLattice {
  double spacing = 1.0;  // edge lengths; distance of neighbouring coordinates along an axis
  int32_t tiles_x = 0;
  int32_t tiles_y = 0;
  int32_t tiles_z = 0;

  AMHEX_HD int64_t tile_count() const { return static_cast<int64_t>(tiles_x) * tiles_y * tiles_z; }
  AMHEX_HD double point_volume() const { return 2.0 * spacing * spacing * spacing; }
  AMHEX_HD int64_t TileAt(int32_t x, int32_t y, int32_t z) const {
    return (static_cast<int64_t>(z) * tiles_y + y) * tiles_x + x;
  }
  // First coordinates of a tile.
  AMHEX_HD LatticePoint TileOrigin(int64_t tile) const {
    const auto x = static_cast<int32_t>(tile % tiles_x);
    const auto y = static_cast<int32_t>(tile / tiles_x % tiles_y);
    const auto z = static_cast<int32_t>(tile / tiles_x / tiles_y);
    return {x * kTileWidth, y * kTileWidth, z * kTileWidth};
  }
  AMHEX_HD Vec3d PositionOf(const LatticePoint& q) const {
    return {q.x * spacing, q.y * spacing, q.z * spacing};
  }

  // The lattice point nearest to `p`, clamped to the tiles: round every coordinate and, if the
  // sum comes out odd, move the one that was rounded farthest.
  AMHEX_HD LatticePoint NearestPoint(const Vec3d& p) const {
    const int32_t limit[3] = {tiles_x * kTileWidth, tiles_y * kTileWidth, tiles_z * kTileWidth};
    int32_t q[3];
    double error[3];
    int farthest = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double scaled = Clamped(p[axis] / spacing, 0.0, static_cast<double>(limit[axis] - 1));
      q[axis] = static_cast<int32_t>(scaled + 0.5);
      error[axis] = scaled - q[axis];
      if (fabs(error[axis]) > fabs(error[farthest])) farthest = axis;
    }
    if (((q[0] + q[1] + q[2]) & 1) != 0) {
      q[farthest] += error[farthest] > 0 ? 1 : -1;
      if (q[farthest] < 0) q[farthest] = 1;
      if (q[farthest] >= limit[farthest]) q[farthest] = limit[farthest] - 2;
    }
    return {q[0], q[1], q[2]};
  }
};

}  // namespace amhex
