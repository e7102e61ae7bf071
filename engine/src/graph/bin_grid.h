// Points sorted into the bins of a uniform grid: the structure behind every neighbour search.
#pragma once

#include <cstdint>

#include "amhex/vec3.h"
#include "base/array_view.h"
#include "base/platform.h"

namespace amhex {

// Bin x, y, z covers [x, x+1) * bin_size and so on; points beyond the grid belong to its rim.
// Points of bin b are ids[starts[b]] .. ids[starts[b + 1] - 1], ascending.
struct BinGrid {
  float bin_size = 1.0f;  // edge lengths
  int32_t count_x = 0;
  int32_t count_y = 0;
  int32_t count_z = 0;
  ArrayView<const int32_t> starts;  // [bin_count + 1]
  ArrayView<const int32_t> ids;     // [point_count or more]

  AMHEX_HD int64_t bin_count() const { return static_cast<int64_t>(count_x) * count_y * count_z; }
  AMHEX_HD int32_t CoordinateOf(float position, int32_t count) const {
    const float scaled = position / bin_size;
    // Clamped before the conversion: a float beyond int32 must not be converted.
    return static_cast<int32_t>(Clamped(scaled, 0.0f, static_cast<float>(count - 1)));
  }
  AMHEX_HD int64_t BinAt(int32_t x, int32_t y, int32_t z) const {
    return (static_cast<int64_t>(z) * count_y + y) * count_x + x;
  }
  AMHEX_HD int64_t BinOf(const Vec3f& p) const {
    return BinAt(CoordinateOf(p.x, count_x), CoordinateOf(p.y, count_y),
                 CoordinateOf(p.z, count_z));
  }
};

// Calls visit(slot) for every point in the box of bins [low, high], both ends included and inside
// the grid; the point is ids[slot]. Points come row by row; ids ascend within a bin only.
template <class Visit>
AMHEX_HD void VisitSlots(const BinGrid& grid, const int32_t (&low)[3], const int32_t (&high)[3],
                         const Visit& visit) {
  for (int32_t z = low[2]; z <= high[2]; ++z) {
    for (int32_t y = low[1]; y <= high[1]; ++y) {
      const int64_t begin = grid.starts[grid.BinAt(low[0], y, z)];
      const int64_t end = grid.starts[grid.BinAt(high[0], y, z) + 1];
      for (int64_t slot = begin; slot < end; ++slot) visit(slot);
    }
  }
}

// The same for all points whose bins meet the cube of half width `radius` around `centre`: every
// point within that distance is among them.
template <class Visit>
AMHEX_HD void VisitSlotsNear(const BinGrid& grid, const Vec3f& centre, float radius,
                             const Visit& visit) {
  const int32_t low[3] = {grid.CoordinateOf(centre.x - radius, grid.count_x),
                          grid.CoordinateOf(centre.y - radius, grid.count_y),
                          grid.CoordinateOf(centre.z - radius, grid.count_z)};
  const int32_t high[3] = {grid.CoordinateOf(centre.x + radius, grid.count_x),
                           grid.CoordinateOf(centre.y + radius, grid.count_y),
                           grid.CoordinateOf(centre.z + radius, grid.count_z)};
  VisitSlots(grid, low, high, visit);
}

// The same with the points' ids.
template <class Visit>
AMHEX_HD void VisitNear(const BinGrid& grid, const Vec3f& centre, float radius,
                        const Visit& visit) {
  VisitSlotsNear(grid, centre, radius, [&](int64_t slot) { visit(grid.ids[slot]); });
}

// Steps of the construction: key every point by its bin, then find where each bin begins.
struct BinKeyBody {
  BinGrid grid;
  ArrayView<const Vec3f> position;
  ArrayView<const int64_t> point_count;  // [1]; points from there on belong to no bin. May be empty
  ArrayView<uint32_t> key;
  ArrayView<int32_t> id;

  AMHEX_HD void operator()(int64_t index) const {
    const bool is_point = point_count.empty() || index < point_count[0];
    key[index] = static_cast<uint32_t>(is_point ? grid.BinOf(position[index]) : grid.bin_count());
    id[index] = static_cast<int32_t>(index);
  }
};

// starts[b] = number of points whose key is below b; one element per bin and one more.
struct BinStartBody {
  ArrayView<const uint32_t> sorted_key;
  ArrayView<int32_t> starts;

  AMHEX_HD void operator()(int64_t bin) const {
    int64_t low = 0;
    int64_t high = sorted_key.size;
    while (low < high) {
      const int64_t middle = (low + high) / 2;
      if (static_cast<int64_t>(sorted_key[middle]) < bin) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    starts[bin] = static_cast<int32_t>(low);
  }
};

}  // namespace amhex
