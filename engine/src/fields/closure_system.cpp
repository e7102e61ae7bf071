#include "fields/closure_system.h"

#include <utility>

#include "fields/field_loops.h"
#include "fields/slot_lanes.h"

namespace amhex::fields {
namespace {

constexpr int kUnknowns = ClosureOperator::kUnknowns;
constexpr int64_t kCubeSize = kCubeSlots * kUnknowns;

// By axis, and which of the two vectors per axis is meant.
using LanesBeside = SlotLanes[3][2][3];

// Of the nodes ahead along kAxis the vectors along the two other axes, in cyclic order.
template <int kAxis>
AMHEX_LANES_INLINE void TakeAhead(const NodeSlots& slots, const float* x, int64_t cube,
                                  LanesBeside& ahead) {
  const float* own = x + kCubeSize * cube;
  const float* next = slots.Beside(NodeSlots::Side::kAhead, kAxis, cube, x, kCubeSize);
  for (int k = 0; k < 2; ++k) {
    const int64_t at = kCubeSlots * 3 * ((kAxis + 1 + k) % 3);
    for (int a = 0; a < 3; ++a) {
      ahead[kAxis][k][a] = OneAhead<kAxis>(LoadFloats(own + at + kCubeSlots * a),
                                           LoadFloats(next + at + kCubeSlots * a));
    }
  }
}

// Of the nodes behind along kAxis the curls around the squares that have an edge along kAxis: its
// own, then the one before.
template <int kAxis>
AMHEX_LANES_INLINE void TakeBehind(const NodeSlots& slots, const float* curls, int64_t cube,
                                   LanesBeside& behind) {
  const float* own = curls + kCubeSize * cube;
  const float* previous = slots.Beside(NodeSlots::Side::kBehind, kAxis, cube, curls, kCubeSize);
  for (int k = 0; k < 2; ++k) {
    const int64_t at = kCubeSlots * 3 * ((kAxis + 2 * k) % 3);
    for (int a = 0; a < 3; ++a) {
      behind[kAxis][k][a] = OneBehind<kAxis>(LoadFloats(own + at + kCubeSlots * a),
                                             LoadFloats(previous + at + kCubeSlots * a));
    }
  }
}

AMHEX_LANES_INLINE void CurlOfCube(const NodeSlots& slots, const uint8_t* is_regular,
                                   const float* x, int64_t cube, float* curls) {
  LanesBeside ahead;
  TakeAhead<0>(slots, x, cube, ahead);
  TakeAhead<1>(slots, x, cube, ahead);
  TakeAhead<2>(slots, x, cube, ahead);
  for (const NodeSlots::RenamedEdge& edge : slots.Renamed(cube, NodeSlots::Side::kAhead)) {
    for (SlotLanes(&vector)[3] : ahead[edge.axis]) {
      ApplyToLane(kAxisRotations[edge.code], edge.lane, vector);
    }
  }
  const float* own = x + kCubeSize * cube;
  for (int d = 0; d < 3; ++d) {
    const int e = (d + 1) % 3;
    const SlotMask regular = MaskOfBits(is_regular[3 * cube + d]);
    for (int a = 0; a < 3; ++a) {
      const SlotLanes curl = LoadFloats(own + kCubeSlots * (3 * d + a)) + ahead[d][0][a] -
                             ahead[e][1][a] - LoadFloats(own + kCubeSlots * (3 * e + a));
      StoreFloats(regular ? curl : SlotLanes{},
                  curls + kCubeSize * cube + kCubeSlots * (3 * d + a));
    }
  }
}

struct Weights {
  const uint8_t* follows;
  float closing, hull;
};

AMHEX_LANES_INLINE void AdjointOfCube(const NodeSlots& slots, const Weights& weights, int64_t cube,
                                      const ClosureSystem::Vectors& vectors) {
  LanesBeside behind;
  TakeBehind<0>(slots, vectors.curls, cube, behind);
  TakeBehind<1>(slots, vectors.curls, cube, behind);
  TakeBehind<2>(slots, vectors.curls, cube, behind);
  for (const NodeSlots::RenamedEdge& edge : slots.Renamed(cube, NodeSlots::Side::kBehind)) {
    for (SlotLanes(&vector)[3] : behind[edge.axis]) {
      ApplyInverseToLane(kAxisRotations[edge.code], edge.lane, vector);
    }
  }
  const float* curls = vectors.curls + kCubeSize * cube;
  for (int d = 0; d < 3; ++d) {
    const int before = (d + 2) % 3, after = (d + 1) % 3;
    for (int a = 0; a < 3; ++a) {
      const int64_t at = int64_t{kCubeSlots} * (3 * d + a);
      const SlotLanes sum = LoadFloats(curls + at) -
                            LoadFloats(curls + kCubeSlots * (3 * before + a)) +
                            behind[before][0][a] - behind[after][1][a];
      constexpr SlotLanes kOne = {1, 1, 1, 1, 1, 1, 1, 1};
      const SlotLanes own = MaskOfBits(weights.follows[int64_t{9} * cube + int64_t{3} * d + a])
                                ? kOne * weights.hull
                                : kOne;
      StoreFloats(own * LoadFloats(vectors.x + kCubeSize * cube + at) + sum * weights.closing,
                  vectors.product + kCubeSize * cube + at);
    }
  }
}

}  // namespace

ClosureSystem::ClosureSystem(const Lattice& lattice, const LatticeSettings& settings,
                             std::vector<uint16_t> follows)
    : level_(lattice.level),
      codes_(lattice.codes),
      run_(lattice.run),
      slots_(level_, codes_, run_),
      weight_(static_cast<float>(settings.closure_weight)),
      hull_weight_(static_cast<float>(settings.hull_edge_weight)),
      follows_(std::move(follows)),
      is_regular_(3 * slots_.cube_count(), 0),
      follows_in_cube_(9 * slots_.cube_count(), 0) {
  ForEach(run_, slots_.cube_count(), [&](int64_t cube) {
    for (int64_t slot = kCubeSlots * cube; slot < kCubeSlots * (cube + 1); ++slot) SetSlot(slot);
  });
}

void ClosureSystem::SetSlot(int64_t slot) {
  const int64_t node = slots_.NodeOf(slot), cube = slot / kCubeSlots;
  if (node < 0) return;
  const unsigned bit = 1U << (slot % kCubeSlots);
  for (int d = 0; d < 3; ++d) {
    uint8_t& regular = is_regular_[3 * cube + d];
    if (IsRegularSquare(level_, codes_, node, d)) regular = static_cast<uint8_t>(regular | bit);
    for (int a = 0; a < 3; ++a) {
      uint8_t& followed = follows_in_cube_[int64_t{9} * cube + int64_t{3} * d + a];
      if (Follows(follows_, node, d, a)) followed = static_cast<uint8_t>(followed | bit);
    }
  }
}

void ClosureSystem::Curls(const Increments& x, Increments* curls) const {
  ForEach(run_, level_.count(), [&](int64_t i) {
    for (int d = 0; d < 3; ++d) {
      (*curls)[i][d] = IsRegular(i, d) ? CurlAround(level_, codes_, x, i, d) : Vec3f{};
    }
  });
}

// C^T curls at one edge: the edge is the first or last leg of two squares of its own node, and an
// opposite leg of a square of two backward neighbours.
Vec3f ClosureSystem::Adjoint(const Increments& curls, int64_t node, int d) const {
  const int before = (d + 2) % 3, after = (d + 1) % 3;
  Vec3f sum = curls[node][d] - curls[node][before];
  if (const int32_t j = level_.neighbours[node][Opposite(before)]; j >= 0) {
    sum += kAxisRotations[codes_[j][before]].ApplyInverse(curls[j][before]);
  }
  if (const int32_t j = level_.neighbours[node][Opposite(after)]; j >= 0) {
    sum -= kAxisRotations[codes_[j][after]].ApplyInverse(curls[j][d]);
  }
  return sum;
}

Vec3f ClosureSystem::DiagonalAt(int64_t node, int d) const {
  const int before = (d + 2) % 3, after = (d + 1) % 3;
  int squares = (IsRegular(node, d) ? 1 : 0) + (IsRegular(node, before) ? 1 : 0);
  if (const int32_t j = level_.neighbours[node][Opposite(before)]; j >= 0) {
    squares += IsRegular(j, before) ? 1 : 0;
  }
  if (const int32_t j = level_.neighbours[node][Opposite(after)]; j >= 0) {
    squares += IsRegular(j, d) ? 1 : 0;
  }
  const float closing = weight_ * static_cast<float>(squares);
  Vec3f diagonal = {closing, closing, closing};
  for (int a = 0; a < 3; ++a) diagonal[a] += Follows(follows_, node, d, a) ? hull_weight_ : 1.0F;
  return diagonal;
}

void ClosureSystem::ApplyCurl(int64_t begin, int64_t end, const float* x, float* curls) const {
  RunWithWidestVectors([&] {
    for (int64_t cube = begin / kCubeSlots; cube < end / kCubeSlots; ++cube) {
      CurlOfCube(slots_, is_regular_.data(), x, cube, curls);
    }
  });
}

void ClosureSystem::ApplyAdjoint(int64_t begin, int64_t end, const Vectors& vectors) const {
  const Weights weights{follows_in_cube_.data(), weight_, hull_weight_};
  RunWithWidestVectors([&] {
    for (int64_t cube = begin / kCubeSlots; cube < end / kCubeSlots; ++cube) {
      AdjointOfCube(slots_, weights, cube, vectors);
    }
  });
}

ClosureOperator ClosureSystem::Matrix(const NodeLinks& links) const {
  return {links,
          {is_regular_.data(), static_cast<int64_t>(is_regular_.size())},
          {follows_in_cube_.data(), static_cast<int64_t>(follows_in_cube_.size())},
          weight_,
          hull_weight_};
}

}  // namespace amhex::fields
