// Label items bundled for the device: what one thread block labels together.
#pragma once

#include <cstdint>
#include <vector>

#include "relax/barrier_view.h"

namespace amhex {

// Tiles of a group along each axis where the lattice is fine.
inline constexpr int kGroupWidthInTiles = 2;
inline constexpr int kGroupTiles = 8;
inline constexpr int32_t kNoItem = -1;
// From this many lattice points per site on eight tiles share most of their candidates, and a warp
// finds at most a lane's worth for its tile: 16 of 32 on average at this number, 49 at 108.
inline constexpr double kLeastPointsPerSiteForGroups = 512;

// Up to eight items of one side; item b lies in octant b of the group (fcc_lattice.h). A group of
// one tile has it in octant 0, and warps share the tile's blocks instead.
struct LabelGroup {
  LatticePoint base;  // first coordinates
  int32_t is_inside = 0;
  int32_t item[kGroupTiles] = {kNoItem, kNoItem, kNoItem, kNoItem,
                               kNoItem, kNoItem, kNoItem, kNoItem};
};

// Every item in exactly one group, groups in the order of their first items. `tiles_per_group` is
// 1 or 8. O(items + tiles).
std::vector<LabelGroup> BundleLabelItems(const FccLattice& lattice,
                                         const std::vector<LabelItem>& items, int tiles_per_group);

// How many tiles a group of this lattice has.
int TilesPerGroup(const FccLattice& lattice);

}  // namespace amhex
