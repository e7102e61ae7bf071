// The hull as the relaxation sees it: which side every lattice point lies on.
#pragma once

#include <cstdint>

#include "base/array_view.h"
#include "relax/fcc_lattice.h"

namespace amhex {

// A tile's side, or the index of its masks where the hull passes through it.
inline constexpr int32_t kTileInside = -1;
inline constexpr int32_t kTileOutside = -2;

// Built once per run by hull_barrier.h.
struct BarrierView {
  FccLattice lattice;
  ArrayView<const int32_t> tile_side;     // [tile_count]
  ArrayView<const uint32_t> inside_mask;  // [mixed_tile_count][8 blocks]; bit p: point p inside

  // Side of the lattice point nearest to `p` (domain frame). O(1).
  AMHEX_HD bool IsInside(const Vec3d& p) const {
    const LatticePoint q = lattice.NearestPoint(p);
    const int32_t side =
        tile_side[lattice.TileAt(q.x / kTileWidth, q.y / kTileWidth, q.z / kTileWidth)];
    if (side < 0) return side == kTileInside;
    const LatticePoint in_tile = {q.x % kTileWidth, q.y % kTileWidth, q.z % kTileWidth};
    const int block = (in_tile.x / kBlockWidth) | ((in_tile.y / kBlockWidth) << 1) |
                      ((in_tile.z / kBlockWidth) << 2);
    const int point =
        IndexInBlock({in_tile.x % kBlockWidth, in_tile.y % kBlockWidth, in_tile.z % kBlockWidth});
    return ((inside_mask[static_cast<int64_t>(side) * kTileBlocks + block] >> point) & 1u) != 0;
  }
};

// A tile to label for one side: the unit of work of the labelling.
struct LabelItem {
  int32_t tile = 0;
  int32_t is_inside = 0;
  int32_t mask = -1;  // of the tile's inside points; -1 = every point belongs to this side
};

}  // namespace amhex
