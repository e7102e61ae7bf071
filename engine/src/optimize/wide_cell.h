// What cell_measures.h measures of one cell, eight numbers at a time, with the same bits. For use
// inside of RunInLanes with eight lanes (base/vector_lanes.h): where registers hold four numbers
// lanes are taken through memory, which takes longer than one number at a time. On the host only.
#pragma once

#include <array>

#include "amhex/vec3.h"
#include "base/vector_lanes.h"
#include "optimize/cell_pattern.h"
#include "optimize/gauss_points.h"

namespace amhex {

class WideCell {
 public:
  AMHEX_LANES_INLINE WideCell(const CellPattern& pattern, const std::array<Vec3d, 8>& positions)
      : pattern_(pattern), positions_(positions) {
    // Three coordinates of every slot, one slot after the other.
    const double* const at = &positions[0].x;
    const DoubleLanes a = LoadDoubles(at), b = LoadDoubles(at + 8), c = LoadDoubles(at + 16);
    slot_ = {__builtin_shufflevector(__builtin_shufflevector(a, b, 0, 3, 6, 9, 12, 15, 0, 0), c, 0,
                                     1, 2, 3, 4, 5, 10, 13),
             __builtin_shufflevector(__builtin_shufflevector(a, b, 1, 4, 7, 10, 13, 0, 0, 0), c, 0,
                                     1, 2, 3, 4, 8, 11, 14),
             __builtin_shufflevector(__builtin_shufflevector(a, b, 2, 5, 8, 11, 14, 0, 0, 0), c, 0,
                                     1, 2, 3, 4, 9, 12, 15)};
  }

  // Of all edges, added one after the other.
  AMHEX_LANES_INLINE double LengthSum() const {
    std::array<double, 16> length;
    for (int e = 0; e < 16; e += kLanes) {
      const VectorLanes edge = EdgesFrom(e);
      StoreDoubles(SquareRoot(edge.Dot(edge)), &length[e]);
    }
    double sum = 0;
    for (int e = 0; e < pattern_.edge_count; ++e) sum += length[e];
    return sum;
  }

  // Of the derivative at the Gauss points and, but for slices, of the triangles seen from the
  // middle; `most` where none is less. What is not a number does not count.
  AMHEX_LANES_INLINE double LeastDeterminant(double most) const {
    DoubleLanes least = DoubleLanes{} + most;
    const auto lower_to = [&](const DoubleLanes& own) { least = own < least ? own : least; };
    const Derivatives along = DerivativesAtGaussPoints();
    lower_to(Determinant(along.u, along.v, along.w));
    if (pattern_.type != PrimitiveType::kSlice) {
      const VectorLanes arm = slot_.From(Middle());
      for (int t = 0; t < pattern_.triangle_count; t += kLanes) {
        lower_to(Determinant(PickedFrom(arm, &pattern_.triangle_corner[0][t]),
                             PickedFrom(arm, &pattern_.triangle_corner[1][t]),
                             PickedFrom(arm, &pattern_.triangle_corner[2][t])));
      }
    }
    lower_to(__builtin_shufflevector(least, least, 4, 5, 6, 7, 0, 1, 2, 3));
    lower_to(__builtin_shufflevector(least, least, 2, 3, 0, 1, 6, 7, 4, 5));
    lower_to(__builtin_shufflevector(least, least, 1, 0, 3, 2, 5, 4, 7, 6));
    return least[0];
  }

  // Scaled Jacobians of the corners; beyond the last the first one's again.
  AMHEX_LANES_INLINE void JacobiansTo(double* jacobians) const {
    const VectorLanes low = UnitEdgesFrom(0), high = UnitEdgesFrom(kLanes);
    const auto edge = [&](int k) {
      const LaneMask which = LoadIndices(pattern_.corner_edge[k].data());
      return VectorLanes{Picked(low.x, high.x, which), Picked(low.y, high.y, which),
                         Picked(low.z, high.z, which)};
    };
    const DoubleLanes sign = LoadDoubles(pattern_.corner_sign.data());
    StoreDoubles(sign * Determinant(edge(0), edge(1), edge(2)), jacobians);
  }

 private:
  struct Derivatives {
    VectorLanes u, v, w;  // by Gauss point
  };

  AMHEX_LANES_INLINE static VectorLanes PickedFrom(const VectorLanes& from, const uint8_t* which) {
    const LaneMask indices = LoadIndices(which);
    return {Picked(from.x, indices), Picked(from.y, indices), Picked(from.z, indices)};
  }
  // Eight edges, the first one `e`.
  AMHEX_LANES_INLINE VectorLanes EdgesFrom(int e) const {
    return PickedFrom(slot_, &pattern_.edge_to[e]) - PickedFrom(slot_, &pattern_.edge_from[e]);
  }
  AMHEX_LANES_INLINE VectorLanes UnitEdgesFrom(int e) const {
    constexpr double kTiny = 1e-300;  // as JacobiansOf
    const VectorLanes edge = EdgesFrom(e);
    const DoubleLanes length = SquareRoot(edge.Dot(edge));
    return edge * (1 / (length < kTiny ? DoubleLanes{} + kTiny : length));
  }
  AMHEX_LANES_INLINE Vec3d Middle() const {
    Vec3d middle;
    for (int i = 0; i < pattern_.vertex_count; ++i) middle += positions_[pattern_.vertex_slot[i]];
    return middle /= pattern_.vertex_count;
  }

  // As GaussJacobians: four parallel edges, interpolated twice, serve two Gauss points each.
  AMHEX_LANES_INLINE Derivatives DerivativesAtGaussPoints() const {
    Derivatives along;
    for (int axis = 0; axis < 3; ++axis) {
      const DoubleLanes& p = slot_[axis];
      const DoubleLanes of_u_and_v =
          Interpolated(__builtin_shufflevector(p, p, 1, 2, 5, 6, 3, 2, 7, 6) -
                       __builtin_shufflevector(p, p, 0, 3, 4, 7, 0, 1, 4, 5));
      along.u[axis] = __builtin_shufflevector(of_u_and_v, of_u_and_v, 0, 0, 1, 1, 2, 2, 3, 3);
      along.v[axis] = __builtin_shufflevector(of_u_and_v, of_u_and_v, 4, 5, 4, 5, 6, 7, 6, 7);
      along.w[axis] = Interpolated(__builtin_shufflevector(p, p, 4, 5, 7, 6, 4, 5, 7, 6) -
                                   __builtin_shufflevector(p, p, 0, 1, 3, 2, 0, 1, 3, 2));
    }
    return along;
  }
  // Twice four numbers, bilinearly.
  AMHEX_LANES_INLINE static DoubleLanes Interpolated(const DoubleLanes& of) {
    constexpr double n = kNearGaussPoint, f = kFarGaussPoint;
    const DoubleLanes once = __builtin_shufflevector(of, of, 0, 0, 2, 2, 4, 4, 6, 6) *
                                 DoubleLanes{n, f, n, f, n, f, n, f} +
                             __builtin_shufflevector(of, of, 1, 1, 3, 3, 5, 5, 7, 7) *
                                 DoubleLanes{f, n, f, n, f, n, f, n};
    return __builtin_shufflevector(once, once, 0, 1, 0, 1, 4, 5, 4, 5) *
               DoubleLanes{n, n, f, f, n, n, f, f} +
           __builtin_shufflevector(once, once, 2, 3, 2, 3, 6, 7, 6, 7) *
               DoubleLanes{f, f, n, n, f, f, n, n};
  }

  const CellPattern& pattern_;
  const std::array<Vec3d, 8>& positions_;
  VectorLanes slot_;
};

}  // namespace amhex
