// Which renaming of the axes brings one frame nearest to another (octahedral_group.h); usable where
// bodies run.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "base/array_view.h"
#include "fields/frame_math.h"
#include "fields/grid_neighbours.h"

namespace amhex::fields {

AMHEX_HD inline Quaternion Multiply(const Quaternion& a, const Quaternion& b) {
  return {
      a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
      a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
AMHEX_HD inline Quaternion Conjugate(const Quaternion& q) { return {q.w, -q.x, -q.y, -q.z}; }

// Codes of rotations: 0..3 one component of the quaternion is 1; 4..15 two are equal in size (six
// pairs, signs equal or opposed); 16..23 all four are (signs of x, y, z against w).
inline constexpr int kFirstPairCode = 4;
inline constexpr int kFirstCornerCode = 16;

// Code of the group element nearest to the rotation `q` (unit up to a positive factor).
AMHEX_HD inline int NearestRotation(const Quaternion& q) {
  constexpr double kHalfRoot2 = std::numbers::sqrt2 / 2;
  // Of the components first and second, in either order.
  constexpr int8_t kPairIndex[4][4] = {{-1, 0, 1, 2}, {0, -1, 3, 4}, {1, 3, -1, 5}, {2, 4, 5, -1}};
  const double c[4] = {q.w, q.x, q.y, q.z};
  int first = 0;
  for (int k = 1; k < 4; ++k) {
    if (std::abs(c[k]) > std::abs(c[first])) first = k;
  }
  int second = first == 0 ? 1 : 0;
  for (int k = 0; k < 4; ++k) {
    if (k != first && std::abs(c[k]) > std::abs(c[second])) second = k;
  }
  const double one = std::abs(c[first]);
  const double two = (one + std::abs(c[second])) * kHalfRoot2;
  const double four = 0.5 * (std::abs(c[0]) + std::abs(c[1]) + std::abs(c[2]) + std::abs(c[3]));
  if (one >= two && one >= four) return first;
  if (two >= four) {
    const bool is_opposed = (c[first] < 0) != (c[second] < 0);
    return kFirstPairCode + 2 * kPairIndex[first][second] + (is_opposed ? 1 : 0);
  }
  int code = kFirstCornerCode;
  for (int k = 0; k < 3; ++k) code += (c[k + 1] < 0) != (c[0] < 0) ? 1 << k : 0;
  return code;
}

// Code of the rotation G with M_j = M_i G most nearly.
AMHEX_HD inline int MatchCode(const Quaternion& qi, const Quaternion& qj) {
  return NearestRotation(Multiply(Conjugate(qi), qj));
}

// For every node and its neighbours along +x +y +z the code of the rotation that carries the
// neighbour's lattice coordinates into the node's; 0 without a neighbour.
using ForwardCodes = std::vector<std::array<uint8_t, 3>>;

// One element per node.
struct MatchNeighboursBody {
  ArrayView<const int32_t> neighbours;  // [node_count][18]
  ArrayView<const Quaternion> frames;
  ArrayView<std::array<uint8_t, 3>> codes;
  AMHEX_HD void operator()(int64_t i) const {
    for (int k = 0; k < 3; ++k) {
      const int32_t j = neighbours[i * kNeighbourCount + k];
      codes[i][k] = j < 0 ? uint8_t{0} : static_cast<uint8_t>(MatchCode(frames[i], frames[j]));
    }
  }
};

}  // namespace amhex::fields
