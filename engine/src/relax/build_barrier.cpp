#include "relax/build_barrier.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "input/hull_queries.h"
#include "relax/row_crossings.h"
#include "relax/site_metric.h"

namespace amhex {
namespace {

// Some 300 MB while being built, and enough for 70 million sites; beyond this the box is absurdly
// larger than the volume it holds. Tiles and rows are numbered by int32 with room to spare.
constexpr double kMaxTiles = 1 << 25;
// How far outside sites may wander from where they started, edge lengths.
constexpr double kOutsideWander = 1.0;

absl::StatusOr<FccLattice> LatticeOver(const Vec3d& extent, double spacing) {
  const double tile_width = spacing * kTileWidth;
  const Vec3d tiles = {std::ceil(extent.x / tile_width), std::ceil(extent.y / tile_width),
                       std::ceil(extent.z / tile_width)};
  const double tile_count = tiles.x * tiles.y * tiles.z;
  if (!(tile_count <= kMaxTiles)) {
    return absl::ResourceExhaustedError(
        absl::StrCat("relaxation.lattice_points_per_site: the lattice over the input's box needs ",
                     tile_count * kTilePoints, " points, limit ", kMaxTiles * kTilePoints,
                     "; ask for fewer cells or fewer lattice points per site"));
  }
  return FccLattice{spacing, static_cast<int32_t>(tiles.x), static_cast<int32_t>(tiles.y),
                    static_cast<int32_t>(tiles.z)};
}

// The tiles of one column along x: their inside bits, then their sides.
struct TileColumn {
  std::vector<uint32_t> mask;  // of all tiles while being filled, of mixed tiles afterwards
  std::vector<int32_t> side;   // mixed tiles hold their index within the column
};

// Sets the bits of the lattice points of row (y, z) with x in [begin, end).
void FillRun(const FccLattice& lattice, int32_t y, int32_t z, int32_t begin, int32_t end,
             std::vector<uint32_t>& mask) {
  begin = std::max(begin, 0);
  end = std::min(end, lattice.tiles_x * kTileWidth);
  const int32_t parity = (y + z) & 1;
  const int block_yz =
      ((y % kTileWidth / kBlockWidth) << 1) | ((z % kTileWidth / kBlockWidth) << 2);
  for (int32_t x = begin + ((begin + parity) & 1); x < end; x += 2) {
    const int block = block_yz | (x % kTileWidth / kBlockWidth);
    const int point = IndexInBlock({x % kBlockWidth, y % kBlockWidth, z % kBlockWidth});
    mask[static_cast<size_t>(x / kTileWidth) * kTileBlocks + static_cast<size_t>(block)] |=
        1u << point;
  }
}

// First lattice coordinate at or beyond a crossing.
int32_t FirstBeyond(double x, double spacing) {
  return static_cast<int32_t>(std::ceil(x / spacing));
}

// A row through a crack: every point asks for itself.
void FillCrackedRow(const Hull& hull, const HullBarrier& barrier, int32_t y, int32_t z,
                    std::vector<uint32_t>& mask) {
  const FccLattice& lattice = barrier.lattice;
  for (int32_t x = (y + z) & 1; x < lattice.tiles_x * kTileWidth; x += 2) {
    if (hull.queries->IsInside(barrier.origin + lattice.PositionOf({x, y, z}))) {
      FillRun(lattice, y, z, x, x + 1, mask);
    }
  }
}

void FillRow(const Hull& hull, const HullBarrier& barrier, int32_t y, int32_t z,
             const RowCrossing* begin, const RowCrossing* end, std::vector<uint32_t>& mask) {
  int32_t winding = 0;
  for (const RowCrossing* c = begin; c != end; ++c) winding += c->sign;
  if (winding != 0) {
    FillCrackedRow(hull, barrier, y, z, mask);
    return;
  }
  const double spacing = barrier.lattice.spacing;
  for (const RowCrossing* c = begin; c + 1 < end; ++c) {
    winding += c->sign;
    if (winding <= 0) continue;
    FillRun(barrier.lattice, y, z, FirstBeyond(c[0].x, spacing), FirstBeyond(c[1].x, spacing),
            mask);
  }
}

TileColumn FillColumn(const Hull& hull, const HullBarrier& barrier,
                      const std::vector<RowCrossing>& crossings, int32_t tile_y, int32_t tile_z) {
  const FccLattice& lattice = barrier.lattice;
  TileColumn column;
  column.side.assign(static_cast<size_t>(lattice.tiles_x), kTileOutside);
  std::vector<uint32_t> mask(static_cast<size_t>(lattice.tiles_x) * kTileBlocks, 0);
  bool is_touched = false;
  for (int32_t z = tile_z * kTileWidth; z < (tile_z + 1) * kTileWidth; ++z) {
    for (int32_t y = tile_y * kTileWidth; y < (tile_y + 1) * kTileWidth; ++y) {
      const int32_t row = RowIndex(lattice, y, z);
      const auto range =
          std::equal_range(crossings.begin(), crossings.end(), RowCrossing{row, 0, 0.0}, ByRow{});
      if (range.first == range.second) continue;
      is_touched = true;
      FillRow(hull, barrier, y, z, &*range.first, &*range.first + (range.second - range.first),
              mask);
    }
  }
  if (!is_touched) return column;
  for (size_t tile = 0; tile < column.side.size(); ++tile) {
    const uint32_t* words = &mask[tile * kTileBlocks];
    const auto is_word = [&](uint32_t value) {
      return std::all_of(words, words + kTileBlocks, [=](uint32_t w) { return w == value; });
    };
    if (is_word(0u)) continue;
    if (is_word(~0u)) {
      column.side[tile] = kTileInside;
      continue;
    }
    column.side[tile] = static_cast<int32_t>(column.mask.size() / kTileBlocks);
    column.mask.insert(column.mask.end(), words, words + kTileBlocks);
  }
  return column;
}

// Joins the columns in their order, so that masks are numbered the same at any thread count.
void JoinColumns(const std::vector<TileColumn>& columns, HullBarrier& barrier) {
  barrier.tile_side.reserve(static_cast<size_t>(barrier.lattice.tile_count()));
  for (const TileColumn& column : columns) {
    const auto first_mask = static_cast<int32_t>(barrier.inside_mask.size() / kTileBlocks);
    for (const int32_t side : column.side) {
      barrier.tile_side.push_back(side < 0 ? side : side + first_mask);
    }
    barrier.inside_mask.insert(barrier.inside_mask.end(), column.mask.begin(), column.mask.end());
  }
}

// 1 for tiles within `reach` tiles of a marked one; one pass per axis.
std::vector<uint8_t> Dilate(const FccLattice& lattice, std::vector<uint8_t> marked, int32_t reach) {
  const int32_t counts[3] = {lattice.tiles_x, lattice.tiles_y, lattice.tiles_z};
  const int64_t strides[3] = {1, lattice.tiles_x,
                              static_cast<int64_t>(lattice.tiles_x) * lattice.tiles_y};
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<uint8_t> wider(marked.size(), 0);
    for (int64_t tile = 0; tile < lattice.tile_count(); ++tile) {
      if (marked[static_cast<size_t>(tile)] == 0) continue;
      const auto at = static_cast<int32_t>(tile / strides[axis] % counts[axis]);
      const int32_t low = std::max(-reach, -at);
      const int32_t high = std::min(reach, counts[axis] - 1 - at);
      for (int32_t step = low; step <= high; ++step) {
        wider[static_cast<size_t>(tile + step * strides[axis])] = 1;
      }
    }
    marked.swap(wider);
  }
  return marked;
}

}  // namespace

absl::StatusOr<HullBarrier> BuildHullBarrier(const Hull& hull, double points_per_site,
                                             double margin, const RunContext& run) {
  HullBarrier barrier;
  // A point stands for 2 * spacing^3.
  const double spacing = std::cbrt(0.5 / points_per_site);
  // Half a spacing off, so that hulls and sites on multiples of the spacing never meet a point.
  const double shift = (std::ceil(margin / spacing) + 0.5) * spacing;
  barrier.origin = hull.box.low - Vec3d{shift, shift, shift};
  barrier.extent = hull.box.Extent() + Vec3d{2 * shift, 2 * shift, 2 * shift};
  AMHEX_ASSIGN_OR_RETURN(barrier.lattice, LatticeOver(barrier.extent, spacing));
  AMHEX_ASSIGN_OR_RETURN(const std::vector<RowCrossing> crossings,
                         CrossRows(hull, barrier.origin, barrier.lattice, run));
  const int32_t column_count = barrier.lattice.tiles_y * barrier.lattice.tiles_z;
  std::vector<TileColumn> columns(static_cast<size_t>(column_count));
  tbb::parallel_for(0, column_count, [&](int32_t index) {
    if (run.ShouldStop()) return;
    columns[static_cast<size_t>(index)] = FillColumn(
        hull, barrier, crossings, index % barrier.lattice.tiles_y, index / barrier.lattice.tiles_y);
  });
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  JoinColumns(columns, barrier);
  return barrier;
}

std::vector<LabelItem> ListLabelItems(const HullBarrier& barrier,
                                      const std::vector<Vec3d>& outside_positions) {
  const FccLattice& lattice = barrier.lattice;
  std::vector<uint8_t> is_outside_near;
  if (!outside_positions.empty()) {
    is_outside_near.assign(static_cast<size_t>(lattice.tile_count()), 0);
    for (const Vec3d& p : outside_positions) {
      const LatticePoint q = lattice.NearestPoint(p);
      is_outside_near[static_cast<size_t>(
          lattice.TileAt(q.x / kTileWidth, q.y / kTileWidth, q.z / kTileWidth))] = 1;
    }
    const double reach = kOutsideWander + static_cast<double>(kOutsideReach);
    is_outside_near =
        Dilate(lattice, std::move(is_outside_near),
               static_cast<int32_t>(std::ceil(reach / (lattice.spacing * kTileWidth))));
  }
  std::vector<LabelItem> items;
  for (int64_t tile = 0; tile < lattice.tile_count(); ++tile) {
    const int32_t side = barrier.tile_side[static_cast<size_t>(tile)];
    if (side != kTileOutside) {
      items.push_back({static_cast<int32_t>(tile), 1, side >= 0 ? side : -1});
    }
    if (side != kTileInside && !is_outside_near.empty() &&
        is_outside_near[static_cast<size_t>(tile)] != 0) {
      items.push_back({static_cast<int32_t>(tile), 0, side >= 0 ? side : -1});
    }
  }
  return items;
}

}  // namespace amhex
