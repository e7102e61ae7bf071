// Parts the samples around a point into the smooth faces that meet there.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "amhex/vec3.h"

namespace amhex {

inline constexpr int kMaxPieces = 3;  // a corner of three faces

struct SmoothPieces {
  int count = 1;               // 1 = smooth, 2 = an edge, 3 = a corner
  std::vector<uint8_t> label;  // [sample_count] piece of each sample
  // [i][j], i < j: the solid is convex where pieces i and j meet.
  std::array<std::array<bool, kMaxPieces>, kMaxPieces> is_convex{};
};

// `position` and unit `normal` of the samples, `weight` > 0 of each. Pieces are told apart by their
// normals: two groups whose means differ by more than 40 degrees while each holds together far
// better than a bend between them would (its spread below 0.18 of the difference; samples spread
// evenly over a bend give 0.29).
SmoothPieces FindSmoothPieces(const std::vector<Vec3d>& position, const std::vector<Vec3d>& normal,
                              const std::vector<double>& weight);

// Combines the pieces' signed distances, negative inside, as their solid does: the larger where it
// is convex, the smaller where it is concave. Returns the index of the deciding piece.
int DecidingPiece(const SmoothPieces& pieces, const std::array<double, kMaxPieces>& distance);

}  // namespace amhex
