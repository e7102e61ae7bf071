// The matrices of the fields' least-squares systems, one node at a time: what a device applies. On
// the host their systems do the same operations in lanes (size_field.cpp, lattice_form.cpp,
// phase_field.cpp); the products are equal to the bit.
//
// Where all that couples nodes are edges of the grid, even nodes (node_order.h) are coupled with
// odd ones only. Then the odd ones' numbers follow from the even ones', and the system that is left
// for these is solved: half the unknowns, half the iterations (Reid 1972). Such a matrix has, by
// number:
//   int64_t solved_count(int64_t node_count) const;  how many are solved for, the first ones
//   void Complete(int64_t i, const float* right_side, float* x) const;  sets the i-th of the others
//     for this right side, or for zeros where it is null
// and Apply is asked for the first ones, of an x that is complete.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <variant>
#include <vector>

#include "base/array_view.h"

namespace amhex::fields {

// An AxisRotation (octahedral_group.h) with its inverse.
struct AxisRenaming {
  uint8_t source[3];   // (G v)[k] = sign[k] * v[source[k]]
  uint8_t inverse[3];  // the axis that k becomes
  float sign[3];
  float inverse_sign[3];
};

// Nodes may stand in cubes of 2 x 2 x 2 of the grid, eight slots to a cube whether the grid has
// those nodes or not (node_slots.h); a slot without a node has neither links nor weights. This is
// where number `which` of a slot is, out of `count`.
inline constexpr int64_t kCubeSlots = 8;
AMHEX_HD constexpr int64_t PlaceInCube(int64_t slot, int count, int which) {
  return slot / kCubeSlots * (kCubeSlots * count) + which * kCubeSlots + slot % kCubeSlots;
}

// Slots numbered anew for a matrix that completes: the even ones (node_order.h) of all cubes, four
// to a cube, then the odd ones. In the order of their cube's lanes the even ones are the lanes 0,
// 3, 5 and 6, the odd ones 1, 2, 4 and 7.
inline constexpr int64_t kHalfSlots = kCubeSlots / 2;
AMHEX_HD constexpr int64_t IsOddLane(int64_t lane) { return (lane ^ lane >> 1 ^ lane >> 2) & 1; }
AMHEX_HD constexpr int64_t NumberOfSlot(int64_t slot, int64_t even_count) {
  return slot / 2 + (IsOddLane(slot % kCubeSlots) != 0 ? even_count : 0);
}
AMHEX_HD constexpr int64_t SlotOfNumber(int64_t number, int64_t even_count) {
  const int64_t is_odd = number < even_count ? 0 : 1;
  const int64_t pair = number - is_odd * even_count;
  return 2 * pair + (is_odd ^ IsOddLane(2 * (pair % kHalfSlots)));
}
// Where number `which` of such a slot is, out of `count`.
AMHEX_HD constexpr int64_t PlaceInHalf(int64_t number, int count, int which) {
  return number / kHalfSlots * (kHalfSlots * count) + which * kHalfSlots + number % kHalfSlots;
}

// Who is next to whom along the grid's axes, and how the axes are called there.
struct NodeLinks {
  ArrayView<const int32_t> neighbours;      // [node_count][6] along +x +y +z -x -y -z, -1 = none
  ArrayView<const uint8_t> codes;           // [node_count][3]
  ArrayView<const AxisRenaming> renamings;  // by code

  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(neighbours), visit(codes), visit(renamings);
  }
  AMHEX_HD int64_t Ahead(int64_t node, int d) const { return neighbours[6 * node + d]; }
  AMHEX_HD int64_t Behind(int64_t node, int d) const { return neighbours[6 * node + 3 + d]; }
  AMHEX_HD const AxisRenaming& RenamingAt(int64_t node, int d) const {
    return renamings[codes[3 * node + d]];
  }
};

// One number per axis: weights times differences along the grid's edges. On slots by their numbers;
// neighbours that are none count as zeros of no weight, as where four slots are dealt with at a
// time.
struct SizeOperator {
  static constexpr int kUnknowns = 3;  // per slot
  static constexpr int kScratch = 0;
  static constexpr int kPasses = 1;
  static constexpr bool kCompletes = true;
  static constexpr int kWeights = 9;
  NodeLinks links;                 // between slots
  ArrayView<const float> weights;  // [d][axis] of the edges ahead
  float regularization = 0;

  template <class Visit>
  void VisitArrays(const Visit& visit) {
    links.VisitArrays(visit), visit(weights);
  }

  AMHEX_HD int64_t even_count() const { return links.codes.size / 3 / 2; }
  AMHEX_HD int64_t solved_count(int64_t /*node_count*/) const { return even_count(); }

  AMHEX_HD static int64_t Place(int64_t number, int unknown) {
    return PlaceInHalf(number, kUnknowns, unknown);
  }
  // Of the matrix; the sum of the weights at a slot, in the order of the host's.
  AMHEX_HD float Diagonal(int64_t number, int axis) const {
    return OfNeighbours(number, axis, nullptr).weight;
  }
  AMHEX_HD void Complete(int64_t odd, const float* right_side, float* x) const {
    const int64_t number = even_count() + odd;
    for (int a = 0; a < 3; ++a) {
      Sums sums = OfNeighbours(number, a, x);
      if (right_side != nullptr) sums.weighted += right_side[Place(number, a)];
      x[Place(number, a)] = sums.weighted / sums.weight;
    }
  }
  AMHEX_HD void Apply(int /*pass*/, int64_t number, const float* x, float* /*scratch*/,
                      float* product) const {
    for (int a = 0; a < 3; ++a) {
      const Sums sums = OfNeighbours(number, a, x);
      product[Place(number, a)] = sums.weight * x[Place(number, a)] - sums.weighted;
    }
  }

 private:
  struct Sums {
    float weight = 0;    // and the regularization
    float weighted = 0;  // numbers of the neighbours times their weights; none of no x
  };
  AMHEX_HD Sums OfNeighbours(int64_t number, int axis, const float* x) const {
    const int64_t slot = SlotOfNumber(number, even_count());
    Sums sums{regularization, 0};
    const auto add = [&](float weight, int64_t other, int of_other) {
      sums.weight += weight;
      if (x != nullptr) sums.weighted += weight * x[Place(other, of_other)];
    };
    for (int d = 0; d < 3; ++d) {
      if (const int64_t j = links.Ahead(slot, d); j >= 0) {
        add(weights[PlaceInHalf(number, kWeights, 3 * d + axis)], NumberOfSlot(j, even_count()),
            links.RenamingAt(slot, d).source[axis]);
      }
      if (const int64_t j = links.Behind(slot, d); j >= 0) {
        const int64_t other = NumberOfSlot(j, even_count());
        const int b = links.RenamingAt(j, d).inverse[axis];
        add(weights[PlaceInHalf(other, kWeights, 3 * d + b)], other, b);
      }
    }
    return sums;
  }
};

// Three numbers per edge: W + K C^T C, C = curl around the regular squares. The first pass leaves
// the curls in the scratch array. On slots; curls around squares that are none are zero.
struct ClosureOperator {
  static constexpr int kUnknowns = 9;
  static constexpr int kScratch = 9;
  static constexpr int kPasses = 2;
  static constexpr bool kCompletes = false;
  NodeLinks links;
  ArrayView<const uint8_t> is_regular;  // [cube][d] bit per slot: its square d
  ArrayView<const uint8_t> follows;  // [cube][d][axis] bit per slot: that number follows the hull
  float weight = 0;                  // K
  float hull_weight = 0;             // W of numbers that follow the hull; the others' is 1

  AMHEX_HD int64_t solved_count(int64_t node_count) const { return node_count; }
  template <class Visit>
  void VisitArrays(const Visit& visit) {
    links.VisitArrays(visit), visit(is_regular), visit(follows);
  }

  AMHEX_HD void Apply(int pass, int64_t i, const float* x, float* scratch, float* product) const {
    for (int d = 0; d < 3; ++d) {
      for (int a = 0; a < 3; ++a) {
        const int64_t at = Place(i, d, a);
        if (pass == 0) {
          scratch[at] = IsRegular(i, d) ? Curl(x, i, d, a) : 0.0F;
        } else {
          product[at] = OwnWeight(i, d, a) * x[at] + Adjoint(scratch, i, d, a) * weight;
        }
      }
    }
  }

  AMHEX_HD static int64_t Place(int64_t i, int unknown) {
    return PlaceInCube(i, kUnknowns, unknown);
  }
  // Of the matrix: W, and K for every square that the edge bounds.
  AMHEX_HD float Diagonal(int64_t i, int unknown) const {
    const int d = unknown / 3, before = (d + 2) % 3, after = (d + 1) % 3;
    int squares = (IsRegular(i, d) ? 1 : 0) + (IsRegular(i, before) ? 1 : 0);
    if (const int64_t j = links.Behind(i, before); j >= 0 && IsRegular(j, before)) ++squares;
    if (const int64_t j = links.Behind(i, after); j >= 0 && IsRegular(j, d)) ++squares;
    return weight * static_cast<float>(squares) + OwnWeight(i, d, unknown % 3);
  }

 private:
  AMHEX_HD bool IsRegular(int64_t i, int d) const {
    return (is_regular[3 * (i / kCubeSlots) + d] >> (i % kCubeSlots) & 1) != 0;
  }
  AMHEX_HD float OwnWeight(int64_t i, int d, int a) const {
    const int which = 3 * d + a;
    const uint8_t followed = follows[9 * (i / kCubeSlots) + which];
    return (followed >> (i % kCubeSlots) & 1) != 0 ? hull_weight : 1.0F;
  }
  AMHEX_HD static int64_t Place(int64_t i, int d, int a) {
    return PlaceInCube(i, kUnknowns, 3 * d + a);
  }
  AMHEX_HD float Curl(const float* x, int64_t i, int d, int a) const {
    const int e = (d + 1) % 3;
    const AxisRenaming &along_d = links.RenamingAt(i, d), &along_e = links.RenamingAt(i, e);
    return x[Place(i, d, a)] + along_d.sign[a] * x[Place(links.Ahead(i, d), e, along_d.source[a])] -
           along_e.sign[a] * x[Place(links.Ahead(i, e), d, along_e.source[a])] - x[Place(i, e, a)];
  }
  // What the curls around square `d` of the node behind along `axis` add.
  AMHEX_HD float CurlBehind(const float* curls, int64_t i, int axis, int d, int a) const {
    const int64_t j = links.Behind(i, axis);
    if (j < 0) return 0;
    const AxisRenaming& renaming = links.RenamingAt(j, axis);
    return renaming.inverse_sign[a] * curls[Place(j, d, renaming.inverse[a])];
  }
  AMHEX_HD float Adjoint(const float* curls, int64_t i, int d, int a) const {
    const int before = (d + 2) % 3, after = (d + 1) % 3;
    return curls[Place(i, d, a)] - curls[Place(i, before, a)] +
           CurlBehind(curls, i, before, before, a) - CurlBehind(curls, i, after, d, a);
  }
};

struct PhaseNumber {
  float real = 0, imaginary = 0;
};

// One complex number per axis, real part first, turned along the grid's edges. Nodes are in their
// order (node_order.h), the even ones first.
struct PhaseOperator {
  static constexpr int kUnknowns = 6;
  static constexpr int kScratch = 0;
  static constexpr int kPasses = 1;
  static constexpr bool kCompletes = true;
  NodeLinks links;
  ArrayView<const float> turns;         // [node_count][d][axis] cosine, sine
  ArrayView<const uint8_t> edge_count;  // [node_count]
  ArrayView<const float> hull_weight;   // [node_count][axis]
  float pull = 0;
  int64_t even_count = 0;

  AMHEX_HD int64_t solved_count(int64_t /*node_count*/) const { return even_count; }

  AMHEX_HD static int64_t Place(int64_t i, int unknown) { return kUnknowns * i + unknown; }
  // Of the matrix; both numbers of a phase have the same.
  AMHEX_HD float Diagonal(int64_t i, int unknown) const {
    return static_cast<float>(edge_count[i]) + hull_weight[3 * i + unknown / 2] + pull;
  }
  // Where the cosine is that turns number `axis` along the edge ahead; its sine follows.
  AMHEX_HD static int64_t Turn(int64_t i, int d, int axis) {
    const int which = 3 * d + axis;
    return 2 * (9 * i + which);
  }
  // What the neighbour ahead, which exists, says that number `axis` of node i is.
  AMHEX_HD PhaseNumber FromAhead(int64_t i, int d, int axis, const float* x) const {
    const AxisRenaming& renaming = links.RenamingAt(i, d);
    const float* psi = x + Place(links.Ahead(i, d), 2 * renaming.source[axis]);
    const float conjugated = renaming.sign[axis] * psi[1];
    const float cosine = turns[Turn(i, d, axis)];
    const float sine = turns[Turn(i, d, axis) + 1];
    return {psi[0] * cosine + conjugated * sine, conjugated * cosine + psi[0] * -sine};
  }
  // The same for the one behind.
  AMHEX_HD PhaseNumber FromBehind(int64_t i, int d, int axis, const float* x) const {
    const int64_t j = links.Behind(i, d);
    const AxisRenaming& renaming = links.RenamingAt(j, d);
    const int b = renaming.inverse[axis];
    const float* psi = x + Place(j, 2 * b);
    const float cosine = turns[Turn(j, d, b)];
    const float sine = turns[Turn(j, d, b) + 1];
    return {psi[0] * cosine + psi[1] * -sine, renaming.sign[b] * (psi[1] * cosine + psi[0] * sine)};
  }
  AMHEX_HD void Complete(int64_t odd, const float* right_side, float* x) const {
    const int64_t i = even_count + odd;
    for (int a = 0; a < 3; ++a) {
      const int64_t at = Place(i, 2 * a);
      PhaseNumber sum = SumOfNeighbours(i, a, x);
      if (right_side != nullptr) sum.real += right_side[at], sum.imaginary += right_side[at + 1];
      const float own = Diagonal(i, 2 * a);
      x[at] = sum.real / own, x[at + 1] = sum.imaginary / own;
    }
  }
  AMHEX_HD void Apply(int /*pass*/, int64_t i, const float* x, float* /*scratch*/,
                      float* product) const {
    for (int a = 0; a < 3; ++a) {
      const float own = Diagonal(i, 2 * a);
      const int64_t at = Place(i, 2 * a);
      const PhaseNumber sum = SumOfNeighbours(i, a, x);
      product[at] = own * x[at] - sum.real;
      product[at + 1] = own * x[at + 1] - sum.imaginary;
    }
  }

 private:
  // Of what they say that number `axis` of node i is.
  AMHEX_HD PhaseNumber SumOfNeighbours(int64_t i, int axis, const float* x) const {
    PhaseNumber sum;
    const auto add = [&sum](const PhaseNumber& there) {
      sum.real += there.real, sum.imaginary += there.imaginary;
    };
    for (int d = 0; d < 3; ++d) {
      if (links.Ahead(i, d) >= 0) add(FromAhead(i, d, axis, x));
      if (links.Behind(i, d) >= 0) add(FromBehind(i, d, axis, x));
    }
    return sum;
  }
};

// The right side of a pulled solve, per node and axis: hull targets, plus the pull towards the unit
// number in the direction of x.
struct PullBody {
  ArrayView<const float> hull_target;
  ArrayView<const float> x;
  float pull = 0;
  ArrayView<float> right_side;
  AMHEX_HD void operator()(int64_t u) const {
    constexpr float kNoDirection = 1e-12F;  // added to lengths: zero has none
    const float real = x[2 * u], imaginary = x[2 * u + 1];
    const double squared = static_cast<double>(real) * static_cast<double>(real) +
                           static_cast<double>(imaginary) * static_cast<double>(imaginary);
    const float factor = pull / (static_cast<float>(std::sqrt(squared)) + kNoDirection);
    right_side[2 * u] = hull_target[2 * u] + factor * real;
    right_side[2 * u + 1] = hull_target[2 * u + 1] + factor * imaginary;
  }
};

// Those that are solved one by one.
using LinearOperator = std::variant<SizeOperator, ClosureOperator>;

}  // namespace amhex::fields
