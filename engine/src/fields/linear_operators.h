// The matrices of the fields' least-squares systems, one node at a time: what a device applies. On
// the host their systems do the same operations in lanes (size_field.cpp, lattice_form.cpp,
// phase_field.cpp); the products are equal to the bit.
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
  int8_t source[3];   // (G v)[k] = sign[k] * v[source[k]]
  int8_t inverse[3];  // the axis that k becomes
  float sign[3];
  float inverse_sign[3];
};

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

// One number per axis: weights times differences along the grid's edges.
struct SizeOperator {
  static constexpr int kUnknowns = 3;  // per node
  static constexpr int kScratch = 0;
  static constexpr int kPasses = 1;
  NodeLinks links;
  ArrayView<const float> weights;  // [node_count][d][axis]
  float regularization = 0;

  template <class Visit>
  void VisitArrays(const Visit& visit) {
    links.VisitArrays(visit), visit(weights);
  }

  AMHEX_HD void Apply(int /*pass*/, int64_t i, const float* x, float* /*scratch*/,
                      float* product) const {
    for (int a = 0; a < 3; ++a) {
      const float own = x[3 * i + a];
      float sum = regularization * own;
      for (int d = 0; d < 3; ++d) {
        if (const int64_t j = links.Ahead(i, d); j >= 0) {
          const int b = links.RenamingAt(i, d).source[a];
          sum += weights[9 * i + 3 * d + a] * (own - x[3 * j + b]);
        }
        if (const int64_t j = links.Behind(i, d); j >= 0) {
          const int b = links.RenamingAt(j, d).inverse[a];
          sum += weights[9 * j + 3 * d + b] * (own - x[3 * j + b]);
        }
      }
      product[3 * i + a] = sum;
    }
  }
};

// Three numbers per edge: W + K C^T C, C = curl around the regular squares. The first pass leaves
// the curls in the scratch array.
struct ClosureOperator {
  static constexpr int kUnknowns = 9;
  static constexpr int kScratch = 9;
  static constexpr int kPasses = 2;
  NodeLinks links;
  ArrayView<const uint8_t> is_regular;  // [node_count] bit d: square d
  ArrayView<const uint16_t> follows;    // [node_count] bit 3 d + a: that number follows the hull
  float weight = 0;                     // K
  float hull_weight = 0;                // W of numbers that follow the hull; the others' is 1

  template <class Visit>
  void VisitArrays(const Visit& visit) {
    links.VisitArrays(visit), visit(is_regular), visit(follows);
  }

  AMHEX_HD void Apply(int pass, int64_t i, const float* x, float* scratch, float* product) const {
    for (int d = 0; d < 3; ++d) {
      for (int a = 0; a < 3; ++a) {
        const int64_t at = 9 * i + 3 * d + a;
        if (pass == 0) {
          scratch[at] = (is_regular[i] >> d & 1) != 0 ? Curl(x, i, d, a) : 0.0F;
        } else {
          const float own = (follows[i] >> (3 * d + a) & 1) != 0 ? hull_weight : 1.0F;
          product[at] = own * x[at] + Adjoint(scratch, i, d, a) * weight;
        }
      }
    }
  }

 private:
  AMHEX_HD float Curl(const float* x, int64_t i, int d, int a) const {
    const int e = (d + 1) % 3;
    const AxisRenaming &along_d = links.RenamingAt(i, d), &along_e = links.RenamingAt(i, e);
    return x[9 * i + 3 * d + a] +
           along_d.sign[a] * x[9 * links.Ahead(i, d) + 3 * e + along_d.source[a]] -
           along_e.sign[a] * x[9 * links.Ahead(i, e) + 3 * d + along_e.source[a]] -
           x[9 * i + 3 * e + a];
  }
  AMHEX_HD float Adjoint(const float* curls, int64_t i, int d, int a) const {
    const int before = (d + 2) % 3, after = (d + 1) % 3;
    float sum = curls[9 * i + 3 * d + a] - curls[9 * i + 3 * before + a];
    if (const int64_t j = links.Behind(i, before); j >= 0) {
      const AxisRenaming& renaming = links.RenamingAt(j, before);
      sum += renaming.inverse_sign[a] * curls[9 * j + 3 * before + renaming.inverse[a]];
    }
    if (const int64_t j = links.Behind(i, after); j >= 0) {
      const AxisRenaming& renaming = links.RenamingAt(j, after);
      sum -= renaming.inverse_sign[a] * curls[9 * j + 3 * d + renaming.inverse[a]];
    }
    return sum;
  }
};

// One complex number per axis, real part first, turned along the grid's edges.
struct PhaseOperator {
  static constexpr int kUnknowns = 6;
  static constexpr int kScratch = 0;
  static constexpr int kPasses = 1;
  NodeLinks links;
  ArrayView<const float> turns;         // [node_count][d][axis] cosine, sine
  ArrayView<const uint8_t> edge_count;  // [node_count]
  ArrayView<const float> hull_weight;   // [node_count][axis]
  float pull = 0;

  template <class Visit>
  void VisitArrays(const Visit& visit) {
    links.VisitArrays(visit), visit(turns), visit(edge_count), visit(hull_weight);
  }

  AMHEX_HD float Diagonal(int64_t i, int axis) const {
    return static_cast<float>(edge_count[i]) + hull_weight[3 * i + axis] + pull;
  }
  AMHEX_HD void Apply(int /*pass*/, int64_t i, const float* x, float* /*scratch*/,
                      float* product) const {
    for (int a = 0; a < 3; ++a) {
      const float own = Diagonal(i, a);
      float real = own * x[6 * i + 2 * a], imaginary = own * x[6 * i + 2 * a + 1];
      for (int d = 0; d < 3; ++d) {
        if (const int64_t j = links.Ahead(i, d); j >= 0) {
          const AxisRenaming& renaming = links.RenamingAt(i, d);
          const float* psi = x + 6 * j + 2 * renaming.source[a];
          const float conjugated = renaming.sign[a] * psi[1];
          const float cosine = turns[18 * i + 6 * d + 2 * a];
          const float sine = turns[18 * i + 6 * d + 2 * a + 1];
          real -= psi[0] * cosine + conjugated * sine;
          imaginary -= conjugated * cosine + psi[0] * -sine;
        }
        if (const int64_t j = links.Behind(i, d); j >= 0) {
          const AxisRenaming& renaming = links.RenamingAt(j, d);
          const int b = renaming.inverse[a];
          const float* psi = x + 6 * j + 2 * b;
          const float cosine = turns[18 * j + 6 * d + 2 * b];
          const float sine = turns[18 * j + 6 * d + 2 * b + 1];
          real -= psi[0] * cosine + psi[1] * -sine;
          imaginary -= renaming.sign[b] * (psi[1] * cosine + psi[0] * sine);
        }
      }
      product[6 * i + 2 * a] = real;
      product[6 * i + 2 * a + 1] = imaginary;
    }
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

using LinearOperator = std::variant<SizeOperator, ClosureOperator, PhaseOperator>;

}  // namespace amhex::fields
