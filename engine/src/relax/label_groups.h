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

// How finely the lattice divides cells decides how the device labels it.
enum class LabelShape {
  kFine,    // eight tiles to a group, each with some ten candidates
  kMedium,  // one tile, with some fifty: a group of eight would have too many
  kCoarse,  // one tile, with up to 256
};
inline constexpr double kLeastPointsPerSiteForFine = 1000;
inline constexpr double kLeastPointsPerSiteForMedium = 64;
// Sites that a group's list has room for: more than a sphere of sites that follow its hull takes at
// the least of these densities.
inline constexpr int kFineCapacity = 96;
inline constexpr int kMediumCapacity = 160;
inline constexpr int kCoarseCapacity = 256;

// Up to eight items of one side; item b lies in octant b of the group (fcc_lattice.h). A group of
// one tile has it in octant 0.
struct LabelGroup {
  LatticePoint base;  // first coordinates
  int32_t is_inside = 0;
  int32_t item[kGroupTiles] = {kNoItem, kNoItem, kNoItem, kNoItem,
                               kNoItem, kNoItem, kNoItem, kNoItem};
  int32_t mask[kGroupTiles] = {-1, -1, -1, -1, -1, -1, -1, -1};  // those of the items
};

// Every item in exactly one group, groups in the order of their first items. `tiles_per_group` is
// 1 or 8. O(items + tiles).
std::vector<LabelGroup> BundleLabelItems(const FccLattice& lattice,
                                         const std::vector<LabelItem>& items, int tiles_per_group);

LabelShape ShapeOf(const FccLattice& lattice);
int TilesPerGroup(LabelShape shape);
// Of device memory.
int64_t LabelBytesPerGroup(LabelShape shape);

}  // namespace amhex
