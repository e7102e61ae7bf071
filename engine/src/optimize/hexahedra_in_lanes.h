// Hexahedra around one vertex, four side by side, as most vertices have eight or, on the hull,
// four: what LocalCells finds of each, with the same bits. On the host only; on a device a thread
// has one vertex.
#pragma once

#include <array>
#include <cstdint>

#include "base/vector_lanes.h"
#include "optimize/cell_energy.h"
#include "optimize/corner_model.h"
#include "optimize/placement_view.h"

namespace amhex {

class HexahedraInLanes {
 public:
  static constexpr int kWidth = kHalfLanes;

  // `hexahedron` is the pattern of all that are added.
  explicit HexahedraInLanes(const CornerPenalty& penalty) : penalty_(penalty) {}

  // A hexahedron at the vertex, in the next lane.
  void Add(const PlacementView& placement, int32_t vertex, int32_t cell);
  // After the last one: what stays as it is wherever the vertex is.
  void Settle();

  // The vertex is at `position` from now on.
  void Score(const Vec3d& position);
  // What one of them has there.
  double MinimumOf(int lane) const { return minimum_[lane]; }
  void AddEnergy(int lane, double& energy) const {
    for (int i = 0; i < ParcelCount(); ++i) energy += energy_[i][lane];
  }
  // The least fold margin of all, were the vertex at `position`.
  double WorstFoldMargin(const Vec3d& position) const;

  // The energy around there, in the order in which it is added up.
  void Model();
  void AddModel(int lane, EnergyModel& model) const;

 private:
  using Numbers = HalfLanes;
  using Vectors = VectorsOf<kWidth>;
  static constexpr int kMoved = 4;  // corners that the vertex moves: three at far ends, its own
  struct Edge {
    Vectors direction;
    Numbers inverse_length;
  };
  struct ModelLanes {
    Vectors gradient;
    std::array<Vectors, 3> hessian;
  };
  // What LocalCells adds one after the other: a cell, or the four corners of one.
  int ParcelCount() const { return penalty_.kind == EnergyKind::kMinima ? 1 : kMoved; }

  void SettleInLanes();
  void ScoreInLanes(const Vec3d& position);
  double MarginInLanes(const Vec3d& position) const;
  void ModelOfMinima();
  void ModelOfCorners();
  AMHEX_LANES_INLINE Numbers InOrder(int i, const Numbers& a, const Numbers& b,
                                     const Numbers& c) const;
  AMHEX_LANES_INLINE Vectors InOrder(int i, const Vectors& a, const Vectors& b,
                                     const Vectors& c) const;
  AMHEX_LANES_INLINE CornerModel<Vectors> ModelOf(int corner) const;

  CornerPenalty penalty_;
  int count_ = 0;
  const CellPattern* pattern_ = nullptr;
  std::array<int, kWidth> slot_{};  // of the vertex
  std::array<Vectors, 8> corner_;   // by slot, the vertex where it was at first
  // Of the corner at the vertex, and of those at the far ends of its edges.
  Numbers own_sign_;
  std::array<Vectors, 3> far_end_, far_normal_;
  HalfMask edge_in_order_[3];  // of the far corners, in the order of the pattern
  Numbers fixed_minimum_, fixed_deficits_;
  // Where the vertex was scored last.
  std::array<Edge, 3> edge_;
  Numbers jacobian_[kMoved];  // in the order of the pattern, the own corner last
  Numbers minimum_, deficits_;
  Numbers energy_[kMoved];
  std::array<ModelLanes, kMoved> model_;
};

}  // namespace amhex
