// Cells of cubic grids under their Morton codes; usable where bodies run.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/array_view.h"
#include "exec/resident_slot.h"

namespace amhex::fields {

// Nodes of the background grid per edge length h.
inline constexpr int kNodesPerEdge = 2;

// Every third bit of a Morton code, packed.
AMHEX_HD inline int32_t CoordinateOfKey(uint64_t bits) {
  bits &= 0x1249249249249249ULL;
  bits = (bits | bits >> 2) & 0x10C30C30C30C30C3ULL;
  bits = (bits | bits >> 4) & 0x100F00F00F00F00FULL;
  bits = (bits | bits >> 8) & 0x001F0000FF0000FFULL;
  bits = (bits | bits >> 16) & 0x001F00000000FFFFULL;
  bits = (bits | bits >> 32) & 0x00000000001FFFFFULL;
  return static_cast<int32_t>(bits);
}

AMHEX_HD inline uint64_t SpreadCoordinate(int32_t value) {
  uint64_t bits = static_cast<uint32_t>(value) & 0x1FFFFFU;
  bits = (bits | bits << 32) & 0x001F00000000FFFFULL;
  bits = (bits | bits << 16) & 0x001F0000FF0000FFULL;
  bits = (bits | bits << 8) & 0x100F00F00F00F00FULL;
  bits = (bits | bits << 4) & 0x10C30C30C30C30C3ULL;
  bits = (bits | bits << 2) & 0x1249249249249249ULL;
  return bits;
}

// Position of a Morton code's cell, in cells.
AMHEX_HD inline std::array<int32_t, 3> CellOfKey(uint64_t key) {
  return {CoordinateOfKey(key), CoordinateOfKey(key >> 1), CoordinateOfKey(key >> 2)};
}
AMHEX_HD inline uint64_t KeyOfCell(const std::array<int32_t, 3>& cell) {
  return SpreadCoordinate(cell[0]) | SpreadCoordinate(cell[1]) << 1 |
         SpreadCoordinate(cell[2]) << 2;
}

// Of a grid of cells of this side, the lower corner of whose cell (0, 0, 0) is `origin`.
AMHEX_HD inline Vec3d CentreOfCell(uint64_t key, const Vec3d& origin, double side) {
  const std::array<int32_t, 3> cell = CellOfKey(key);
  return origin + Vec3d{cell[0] + 0.5, cell[1] + 0.5, cell[2] + 0.5} * side;
}

// Centres of cells, as points to ask the hull about.
struct CellCentres {
  ArrayView<const uint64_t> keys;
  Vec3d origin;
  double side = 0;
  ResidentSlot* resident = nullptr;  // of the keys; null: copied for every task

  int64_t count() const { return keys.size; }
  AMHEX_HD Vec3d operator[](int64_t i) const { return CentreOfCell(keys[i], origin, side); }
  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(keys);
  }
};

inline CellCentres CentresOf(const std::vector<uint64_t>& keys, const Vec3d& origin, double side) {
  return {{keys.data(), static_cast<int64_t>(keys.size())}, origin, side};
}

}  // namespace amhex::fields
