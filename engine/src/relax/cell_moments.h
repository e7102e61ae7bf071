// What a cell's lattice points add up to, in integers: exact, and equal in any order of addition.
#pragma once

#include <cstdint>

#include "base/array_view.h"
#include "base/platform.h"
#include "relax/fcc_lattice.h"

namespace amhex {

// Sums over the lattice points of one cell.
struct CellMoments {
  int64_t count = 0;
  int64_t x = 0, y = 0, z = 0;  // lattice coordinates
  // Products of coordinates, only when asked for (the principal direction of section 4.4).
  int64_t xx = 0, yy = 0, zz = 0, xy = 0, yz = 0, zx = 0;
};

// Bits of the point number p (fcc_lattice.h) as masks over the 32 points of a block: in which
// points the bit of weight 1 or 2 of a coordinate is set.
inline constexpr uint32_t kXHigh = 0xAAAAAAAAu;  // p bit 0
inline constexpr uint32_t kYLow = 0xCCCCCCCCu;   // p bit 1
inline constexpr uint32_t kYHigh = 0xF0F0F0F0u;  // p bit 2
inline constexpr uint32_t kZLow = 0xFF00FF00u;   // p bit 3
inline constexpr uint32_t kZHigh = 0xFFFF0000u;  // p bit 4
inline constexpr uint32_t kXLow = kYLow ^ kZLow;

// Sum over the points in `owned` of the coordinate with these bit masks.
AMHEX_HD inline int32_t SumOfCoordinate(uint32_t owned, uint32_t low, uint32_t high) {
  return CountBits(owned & low) + 2 * CountBits(owned & high);
}

// Sum of the products of two coordinates: (l + 2h)(m + 2k) = lm + 2lk + 2hm + 4hk.
AMHEX_HD inline int32_t SumOfProduct(uint32_t owned, uint32_t low_a, uint32_t high_a,
                                     uint32_t low_b, uint32_t high_b) {
  return CountBits(owned & low_a & low_b) +
         2 * (CountBits(owned & low_a & high_b) + CountBits(owned & high_a & low_b)) +
         4 * CountBits(owned & high_a & high_b);
}

// Count and first sums of the owned points of the block that begins at `base`.
AMHEX_HD inline void AddFirstMoments(uint32_t owned, const LatticePoint& base,
                                     CellMoments& moments) {
  const int64_t count = CountBits(owned);
  AtomicAdd(&moments.count, count);
  AtomicAdd(&moments.x, count * base.x + SumOfCoordinate(owned, kXLow, kXHigh));
  AtomicAdd(&moments.y, count * base.y + SumOfCoordinate(owned, kYLow, kYHigh));
  AtomicAdd(&moments.z, count * base.z + SumOfCoordinate(owned, kZLow, kZHigh));
}

// Sum of (base_a + a)(base_b + b).
AMHEX_HD inline int64_t ShiftedProduct(int64_t count, int64_t base_a, int64_t sum_a, int64_t base_b,
                                       int64_t sum_b, int64_t sum_product) {
  return count * base_a * base_b + base_a * sum_b + base_b * sum_a + sum_product;
}

// The second sums of the owned points of the block that begins at `base`; the first stay zero.
AMHEX_HD inline CellMoments SecondMomentsOf(uint32_t owned, const LatticePoint& base) {
  const int64_t count = CountBits(owned);
  const int64_t x = SumOfCoordinate(owned, kXLow, kXHigh);
  const int64_t y = SumOfCoordinate(owned, kYLow, kYHigh);
  const int64_t z = SumOfCoordinate(owned, kZLow, kZHigh);
  const int64_t xx = SumOfProduct(owned, kXLow, kXHigh, kXLow, kXHigh);
  const int64_t yy = SumOfProduct(owned, kYLow, kYHigh, kYLow, kYHigh);
  const int64_t zz = SumOfProduct(owned, kZLow, kZHigh, kZLow, kZHigh);
  const int64_t xy = SumOfProduct(owned, kXLow, kXHigh, kYLow, kYHigh);
  const int64_t yz = SumOfProduct(owned, kYLow, kYHigh, kZLow, kZHigh);
  const int64_t zx = SumOfProduct(owned, kZLow, kZHigh, kXLow, kXHigh);
  CellMoments m;
  m.xx = ShiftedProduct(count, base.x, x, base.x, x, xx);
  m.yy = ShiftedProduct(count, base.y, y, base.y, y, yy);
  m.zz = ShiftedProduct(count, base.z, z, base.z, z, zz);
  m.xy = ShiftedProduct(count, base.x, x, base.y, y, xy);
  m.yz = ShiftedProduct(count, base.y, y, base.z, z, yz);
  m.zx = ShiftedProduct(count, base.z, z, base.x, x, zx);
  return m;
}

AMHEX_HD inline void AddSecondMoments(uint32_t owned, const LatticePoint& base,
                                      CellMoments& moments) {
  const CellMoments m = SecondMomentsOf(owned, base);
  AtomicAdd(&moments.xx, m.xx);
  AtomicAdd(&moments.yy, m.yy);
  AtomicAdd(&moments.zz, m.zz);
  AtomicAdd(&moments.xy, m.xy);
  AtomicAdd(&moments.yz, m.yz);
  AtomicAdd(&moments.zx, m.zx);
}

// One element per number, not per cell: neighbouring threads of a device write side by side.
struct ClearMomentsBody {
  static constexpr int64_t kNumbers = sizeof(CellMoments) / sizeof(int64_t);
  ArrayView<CellMoments> moments;
  AMHEX_HD void operator()(int64_t number) const {
    reinterpret_cast<int64_t*>(moments.data)[number] = 0;
  }
};

}  // namespace amhex
