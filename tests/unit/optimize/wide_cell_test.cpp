// A cell measured eight numbers at a time measures what it does one number at a time.
#include "optimize/wide_cell.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "optimize/cell_measures.h"
#include "optimize/cell_pattern.h"

namespace amhex {
namespace {

constexpr int kCellsPerPattern = 20;

// A cube whose corners are up to `shake` off, of some size somewhere.
CellPositions ShakenCube(double shake, std::mt19937_64& random) {
  std::uniform_real_distribution<double> off(-shake, shake), size(0.01, 30.0), shift(-50, 50);
  const double scale = size(random);
  const Vec3d at{shift(random), shift(random), shift(random)};
  CellPositions positions;
  for (int slot = 0; slot < 8; ++slot) {
    const double x = slot == 1 || slot == 2 || slot == 5 || slot == 6 ? 1 : 0;
    const double y = slot == 2 || slot == 3 || slot == 6 || slot == 7 ? 1 : 0;
    const double z = slot >= 4 ? 1 : 0;
    positions[slot] = at + Vec3d{x + off(random), y + off(random), z + off(random)} * scale;
  }
  return positions;
}

void ExpectTheSameBits(double a, double b) {
  if (std::isnan(a) && std::isnan(b)) return;
  EXPECT_EQ(std::bit_cast<uint64_t>(a), std::bit_cast<uint64_t>(b)) << a << " and " << b;
}

void ExpectTheSameMeasures(const CellPattern& pattern, const CellPositions& positions) {
  CornerJacobians one_by_one{}, found{};
  JacobiansOf(pattern, positions, one_by_one);
  ScaledJacobians(pattern, positions, found);
  for (int i = 0; i < pattern.corner_count; ++i) ExpectTheSameBits(found[i], one_by_one[i]);
  ExpectTheSameBits(FoldMargin(pattern, positions), MarginOf(pattern, positions));
}

// With the widest vectors of the machine.
template <class Check>
void ForAllPatterns(const Check& check) {
  ASSERT_GT(AllCellPatterns().size(), 8U);
  for (const CellPattern& pattern : AllCellPatterns()) check(pattern);
}

TEST(WideCell, MeasuresCellsOfEveryPattern) {
  std::mt19937_64 random(7);
  int folded = 0, sound = 0;
  ForAllPatterns([&](const CellPattern& pattern) {
    for (int i = 0; i < kCellsPerPattern; ++i) {
      const CellPositions positions = ShakenCube(i % 2 == 0 ? 0.2 : 0.8, random);
      ExpectTheSameMeasures(pattern, positions);
      ++(MarginOf(pattern, positions) > 0 ? sound : folded);
    }
  });
  EXPECT_GT(folded, 100);
  EXPECT_GT(sound, 100);
}

TEST(WideCell, MeasuresFlatCellsAndPoints) {
  std::mt19937_64 random(8);
  ForAllPatterns([&](const CellPattern& pattern) {
    CellPositions flat = ShakenCube(0.3, random);
    for (Vec3d& p : flat) p.z = 0;
    ExpectTheSameMeasures(pattern, flat);
    CellPositions collapsed = flat;
    collapsed.fill({1, 2, 3});
    ExpectTheSameMeasures(pattern, collapsed);
  });
}

TEST(WideCell, MeasuresWhatIsNowhere) {
  std::mt19937_64 random(9);
  for (const double nowhere :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e200}) {
    ForAllPatterns([&](const CellPattern& pattern) {
      for (int slot = 0; slot < 8; ++slot) {
        CellPositions positions = ShakenCube(0.2, random);
        positions[slot].y = nowhere;
        ExpectTheSameMeasures(pattern, positions);
      }
    });
  }
}

}  // namespace
}  // namespace amhex
