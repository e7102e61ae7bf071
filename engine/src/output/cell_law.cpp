#include "output/cell_law.h"

#include <algorithm>
#include <array>
#include <utility>

namespace amhex {
namespace {

struct PatternOfType {
  PrimitiveType type;
  std::array<int, 8> corners;
};
constexpr PatternOfType kPatterns[7] = {
    {PrimitiveType::kHexahedron, {0, 1, 2, 3, 4, 5, 6, 7}},
    {PrimitiveType::kHexprism, {0, 1, 1, 2, 3, 4, 5, 6}},
    {PrimitiveType::kPrism, {0, 1, 1, 2, 3, 4, 4, 5}},
    {PrimitiveType::kSlice, {0, 1, 1, 2, 3, 4, 4, 3}},
    {PrimitiveType::kPyramid, {0, 1, 1, 2, 0, 3, 3, 4}},
    {PrimitiveType::kPyramid, {0, 1, 1, 2, 3, 1, 1, 4}},
    {PrimitiveType::kTetrahedron, {0, 1, 1, 2, 0, 3, 3, 2}},
};

// Which corners are equal, as one number: three bits per slot, naming the first equal slot.
template <class Array>
uint32_t EqualityCode(const Array& corners) {
  uint32_t code = 0;
  for (uint32_t i = 0; i < 8; ++i) {
    uint32_t first = 0;
    while (corners[first] != corners[i]) ++first;
    code |= first << (3 * i);
  }
  return code;
}

using CodedType = std::pair<uint32_t, PrimitiveType>;

// The codes of all patterns under all 48 symmetries (axis permutations and reversals), sorted.
std::vector<CodedType> AllCodes() {
  constexpr int kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  std::vector<CodedType> codes;
  for (const PatternOfType& pattern : kPatterns) {
    for (const auto& order : kOrders) {
      for (int flip = 0; flip < 8; ++flip) {
        std::array<int, 8> moved{};
        for (int slot = 0; slot < 8; ++slot) {
          int place[3];
          for (int a = 0; a < 3; ++a)
            place[a] = cell_law::PlaceOfSlot(slot, order[a]) ^ (flip >> a & 1);
          moved[cell_law::SlotAt(place[0], place[1], place[2])] = pattern.corners[slot];
        }
        codes.push_back({EqualityCode(moved), pattern.type});
      }
    }
  }
  std::sort(codes.begin(), codes.end());
  codes.erase(std::unique(codes.begin(), codes.end()), codes.end());
  return codes;
}

}  // namespace

std::optional<PrimitiveType> TypeByPattern(const CellCorners& corners) {
  static const std::vector<CodedType> kCodes = AllCodes();
  const uint32_t code = EqualityCode(corners);
  const auto found = std::lower_bound(
      kCodes.begin(), kCodes.end(), code,
      [](const CodedType& entry, uint32_t wanted) { return entry.first < wanted; });
  if (found == kCodes.end() || found->first != code) return std::nullopt;
  return found->second;
}

CellMeasures MeasureCell(const CellCorners& corners, const std::vector<Vec3d>& vertices) {
  return MeasureCell(corners, ArrayView{vertices.data(), static_cast<int64_t>(vertices.size())});
}

}  // namespace amhex
