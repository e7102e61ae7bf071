#include "output/cell_law.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace amhex {
namespace {

// Parameter coordinates of the corner slots in VTK_HEXAHEDRON order.
constexpr int kSlotPlace[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                  {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};

// Outward rings of the cube's faces: the hexahedron's line of Figure 2.
constexpr int kRings[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                              {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};

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

int SlotAt(int x, int y, int z) {
  constexpr int kSlots[2][2][2] = {{{0, 4}, {3, 7}}, {{1, 5}, {2, 6}}};
  return kSlots[x][y][z];
}

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
          for (int a = 0; a < 3; ++a) place[a] = kSlotPlace[slot][order[a]] ^ (flip >> a & 1);
          moved[SlotAt(place[0], place[1], place[2])] = pattern.corners[slot];
        }
        codes.push_back({EqualityCode(moved), pattern.type});
      }
    }
  }
  std::sort(codes.begin(), codes.end());
  codes.erase(std::unique(codes.begin(), codes.end()), codes.end());
  return codes;
}

// The trilinear map's Jacobian determinant at parameter point (u, v, w) of the unit cube.
double MapJacobian(const std::array<Vec3d, 8>& x, double u, double v, double w) {
  Vec3d du, dv, dw;
  for (int i = 0; i < 8; ++i) {
    const double a = kSlotPlace[i][0] ? u : 1 - u, da = kSlotPlace[i][0] ? 1 : -1;
    const double b = kSlotPlace[i][1] ? v : 1 - v, db = kSlotPlace[i][1] ? 1 : -1;
    const double c = kSlotPlace[i][2] ? w : 1 - w, dc = kSlotPlace[i][2] ? 1 : -1;
    du += x[i] * (da * b * c);
    dv += x[i] * (a * db * c);
    dw += x[i] * (a * b * dc);
  }
  return Determinant(du, dv, dw);
}

// True if the three parameter edges at `slot` lead to three vertices other than its own.
bool IsUncollapsed(const CellCorners& corners, int slot) {
  const auto& p = kSlotPlace[slot];
  const int32_t a = corners[SlotAt(1 - p[0], p[1], p[2])];
  const int32_t b = corners[SlotAt(p[0], 1 - p[1], p[2])];
  const int32_t c = corners[SlotAt(p[0], p[1], 1 - p[2])];
  const int32_t v = corners[slot];
  return v != a && v != b && v != c && a != b && b != c && c != a;
}

// The scaled Jacobian at the j-th vertex of `face`, or 1 where not exactly three edges meet.
double ScaledJacobianAt(const OutwardFaces& faces, const OutwardFace& face, int j,
                        const std::vector<Vec3d>& vertices) {
  const int32_t at = face.v[j];
  const int32_t next = face.v[(j + 1) % face.count];
  const int32_t previous = face.v[(j + face.count - 1) % face.count];
  int incident_faces = 0;
  int32_t third = -1;
  for (const OutwardFace& other : faces) {
    for (int k = 0; k < other.count; ++k) {
      if (other.v[k] != at) continue;
      ++incident_faces;
      if (other.v[(k + 1) % other.count] == previous) {
        third = other.v[(k + other.count - 1) % other.count];
      }
    }
  }
  if (incident_faces != 3) return 1.0;
  if (third < 0) return -1.0;
  const Vec3d a = Normalized(vertices[previous] - vertices[at]);
  const Vec3d b = Normalized(vertices[next] - vertices[at]);
  const Vec3d c = Normalized(vertices[third] - vertices[at]);
  return Determinant(a, b, c);
}

}  // namespace

std::optional<PrimitiveType> TypeByPattern(const CellCorners& corners) {
  static const std::vector<CodedType> codes = AllCodes();
  const uint32_t code = EqualityCode(corners);
  const auto found = std::lower_bound(
      codes.begin(), codes.end(), code,
      [](const CodedType& entry, uint32_t wanted) { return entry.first < wanted; });
  if (found == codes.end() || found->first != code) return std::nullopt;
  return found->second;
}

OutwardFaces OutwardFacesOf(const CellCorners& corners) {
  OutwardFaces faces;
  for (const auto& ring : kRings) {
    OutwardFace face;
    for (int j = 0; j < 4; ++j) {
      const int32_t v = corners[ring[j]];
      if (v != corners[ring[(j + 1) % 4]]) face.v[face.count++] = v;
    }
    const bool folded = face.count == 4 && (face.v[0] == face.v[2] || face.v[1] == face.v[3]);
    if (face.count >= 3 && !folded) faces.face[faces.count++] = face;
  }
  return faces;
}

CellMeasures MeasureCell(const CellCorners& corners, const std::vector<Vec3d>& vertices) {
  std::array<Vec3d, 8> x;
  for (int i = 0; i < 8; ++i) x[i] = vertices[corners[i]];
  CellMeasures measures;
  measures.min_scaled_jacobian = 1.0;
  measures.min_map_jacobian = 1e300;
  const double gauss[2] = {0.5 - std::sqrt(1.0 / 12.0), 0.5 + std::sqrt(1.0 / 12.0)};
  for (int i = 0; i < 8; ++i) {
    const double jacobian = MapJacobian(x, gauss[i & 1], gauss[i >> 1 & 1], gauss[i >> 2]);
    measures.volume += jacobian / 8;
    measures.min_map_jacobian = std::min(measures.min_map_jacobian, jacobian);
  }
  for (int slot = 0; slot < 8; ++slot) {
    if (!IsUncollapsed(corners, slot)) continue;
    const auto& p = kSlotPlace[slot];
    measures.min_map_jacobian =
        std::min(measures.min_map_jacobian, MapJacobian(x, p[0], p[1], p[2]));
  }
  const OutwardFaces faces = OutwardFacesOf(corners);
  for (const OutwardFace& face : faces) {
    for (int j = 0; j < face.count; ++j) {
      measures.min_scaled_jacobian =
          std::min(measures.min_scaled_jacobian, ScaledJacobianAt(faces, face, j, vertices));
    }
  }
  return measures;
}

}  // namespace amhex
