#include "relax/label_groups.h"

#include <cstddef>

namespace amhex {
namespace {

LabelGroup GroupOfOne(const FccLattice& lattice, const LabelItem& item, int32_t index) {
  LabelGroup group;
  group.base = lattice.TileOrigin(item.tile);
  group.is_inside = item.is_inside;
  group.item[0] = index;
  group.mask[0] = item.mask;
  return group;
}

}  // namespace

LabelShape ShapeOf(const FccLattice& lattice) {
  const double points_per_site = 1.0 / lattice.point_volume();
  if (points_per_site >= kLeastPointsPerSiteForFine) return LabelShape::kFine;
  if (points_per_site >= kLeastPointsPerSiteForMedium) return LabelShape::kMedium;
  return LabelShape::kCoarse;
}

int TilesPerGroup(LabelShape shape) { return shape == LabelShape::kFine ? kGroupTiles : 1; }

int64_t LabelBytesPerGroup(LabelShape shape) {
  // How many sites, both reaches, what is left; and where sites are found beforehand their list.
  constexpr size_t kNumbers = 4;
  const size_t listed = shape == LabelShape::kFine ? kFineCapacity : 0;
  return static_cast<int64_t>(sizeof(LabelGroup) + sizeof(int32_t) * (kNumbers + listed));
}

std::vector<LabelGroup> BundleLabelItems(const FccLattice& lattice,
                                         const std::vector<LabelItem>& items, int tiles_per_group) {
  std::vector<LabelGroup> groups;
  if (tiles_per_group == 1) {
    groups.reserve(items.size());
    for (size_t i = 0; i < items.size(); ++i) {
      groups.push_back(GroupOfOne(lattice, items[i], static_cast<int32_t>(i)));
    }
    return groups;
  }
  constexpr int32_t kWidth = kGroupWidthInTiles * kTileWidth;
  const auto count = [](int32_t tiles) {
    return static_cast<size_t>((tiles + kGroupWidthInTiles - 1) / kGroupWidthInTiles);
  };
  const size_t count_x = count(lattice.tiles_x), count_y = count(lattice.tiles_y);
  // Which group holds a cell of the coarser grid, for the outside and for the inside.
  std::vector<int32_t> group_of(2 * count_x * count_y * count(lattice.tiles_z), kNoItem);
  for (size_t i = 0; i < items.size(); ++i) {
    const LatticePoint origin = lattice.TileOrigin(items[i].tile);
    const LatticePoint at = {origin.x / kWidth, origin.y / kWidth, origin.z / kWidth};
    const size_t cell =
        (static_cast<size_t>(at.z) * count_y + static_cast<size_t>(at.y)) * count_x +
        static_cast<size_t>(at.x);
    int32_t& group = group_of[2 * cell + static_cast<size_t>(items[i].is_inside)];
    if (group == kNoItem) {
      group = static_cast<int32_t>(groups.size());
      groups.push_back({});
      groups.back().base = {at.x * kWidth, at.y * kWidth, at.z * kWidth};
      groups.back().is_inside = items[i].is_inside;
    }
    const int octant = (origin.x / kTileWidth % kGroupWidthInTiles) |
                       (origin.y / kTileWidth % kGroupWidthInTiles) << 1 |
                       (origin.z / kTileWidth % kGroupWidthInTiles) << 2;
    groups[static_cast<size_t>(group)].item[octant] = static_cast<int32_t>(i);
    groups[static_cast<size_t>(group)].mask[octant] = items[i].mask;
  }
  return groups;
}

}  // namespace amhex
