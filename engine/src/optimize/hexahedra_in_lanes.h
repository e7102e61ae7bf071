// Hexahedra around one vertex, eight side by side: what LocalCells finds of each, with the same
// bits. On the host only; on a device a thread has one vertex.
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
  // `hexahedron` is the pattern of all that are added.
  explicit HexahedraInLanes(const CornerPenalty& penalty) : penalty_(penalty) {}

  bool IsFull() const { return count_ == kLanes; }
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
  static constexpr int kMoved = 4;  // corners that the vertex moves: three at far ends, its own
  struct Edge {
    VectorLanes direction;
    DoubleLanes inverse_length;
  };
  struct ModelLanes {
    VectorLanes gradient;
    std::array<VectorLanes, 3> hessian;
  };
  // What LocalCells adds one after the other: a cell, or the four corners of one.
  int ParcelCount() const { return penalty_.kind == EnergyKind::kMinima ? 1 : kMoved; }

  void SettleInLanes();
  void ScoreInLanes(const Vec3d& position);
  double MarginInLanes(const Vec3d& position) const;
  void ModelOfMinima();
  void ModelOfCorners();
  AMHEX_LANES_INLINE DoubleLanes InOrder(int i, const DoubleLanes& a, const DoubleLanes& b,
                                         const DoubleLanes& c) const;
  AMHEX_LANES_INLINE VectorLanes InOrder(int i, const VectorLanes& a, const VectorLanes& b,
                                         const VectorLanes& c) const;
  AMHEX_LANES_INLINE CornerModel<VectorLanes> ModelOf(int corner) const;

  CornerPenalty penalty_;
  int count_ = 0;
  const CellPattern* pattern_ = nullptr;
  std::array<int, kLanes> slot_{};     // of the vertex
  std::array<VectorLanes, 8> corner_;  // by slot, the vertex where it was at first
  // Of the corner at the vertex, and of those at the far ends of its edges.
  DoubleLanes own_sign_;
  std::array<VectorLanes, 3> far_end_, far_normal_;
  LaneMask edge_in_order_[3];  // of the far corners, in the order of the pattern
  DoubleLanes fixed_minimum_, fixed_deficits_;
  // Where the vertex was scored last.
  std::array<Edge, 3> edge_;
  DoubleLanes jacobian_[kMoved];  // in the order of the pattern, the own corner last
  DoubleLanes minimum_, deficits_;
  DoubleLanes energy_[kMoved];
  std::array<ModelLanes, kMoved> model_;
};

}  // namespace amhex
