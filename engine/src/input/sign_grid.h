// The values of a field on the part of a regular grid around its surface.
#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "absl/status/status.h"
#include "amhex/run_context.h"
#include "input/level_surface.h"

namespace amhex {

using NodeIndex = std::array<int64_t, 3>;

// Blocks of 2 x 2 x 2 nodes, evaluated when the surface comes near: larger ones would reach far
// from it, and a value costs more than finding its block.
class SignGrid {
 public:
  SignGrid(const LevelGrid& grid, const SurfaceField& field) : grid_(grid), field_(field) {}

  // Evaluates around the seeds, follows the surface, and makes the signs well-composed.
  absl::Status Fill(const std::vector<Vec3d>& seeds, RunContext& run);

  // False away from the surface, where the field was never evaluated and nothing is known.
  bool Has(const NodeIndex& node) const {
    return IsOnGrid(node) && block_of_key_.count(KeyOf(node)) > 0;
  }
  // Nodes in the grid's two outermost layers count as far outside.
  double Value(const NodeIndex& node) const;
  bool IsInside(const NodeIndex& node) const { return Value(node) < 0; }
  Vec3d Position(const NodeIndex& node) const;

  // Calls visit(node) for every node that has a value, in order of their blocks' keys.
  template <class Visit>
  void ForEachNode(const Visit& visit) const {
    for (const int64_t key : sorted_keys_) {
      const NodeIndex corner = CornerOf(key);
      for (int64_t z = 0; z < kBlockSide; ++z) {
        for (int64_t y = 0; y < kBlockSide; ++y) {
          for (int64_t x = 0; x < kBlockSide; ++x) {
            const NodeIndex node = {corner[0] + x, corner[1] + y, corner[2] + z};
            if (IsOnGrid(node)) visit(node);
          }
        }
      }
    }
  }

  // One number per node of the grid, for sorting.
  int64_t Serial(const NodeIndex& node) const {
    return (node[2] * grid_.node_count[1] + node[1]) * grid_.node_count[0] + node[0];
  }

 private:
  static constexpr int64_t kBlockSide = 2;
  static constexpr int64_t kBlockNodes = kBlockSide * kBlockSide * kBlockSide;

  int64_t KeyOf(const NodeIndex& node) const;
  NodeIndex CornerOf(int64_t key) const;
  bool IsOnGrid(const NodeIndex& node) const;
  float* Find(const NodeIndex& node);
  std::vector<int64_t> BlocksAround(const std::vector<Vec3d>& seeds) const;
  absl::Status Evaluate(std::vector<int64_t> keys, RunContext& run);
  std::vector<int64_t> BlocksToFollow() const;
  int64_t Compose();
  bool ComposeFace(const NodeIndex& node, int axis_u, int axis_v);
  bool ComposeCube(const NodeIndex& node);
  bool TurnInside(const NodeIndex& node);  // false if the node has no value yet

  const LevelGrid grid_;
  const SurfaceField& field_;
  std::unordered_map<int64_t, int32_t> block_of_key_;  // looked up, never iterated
  std::vector<int64_t> sorted_keys_;
  std::vector<float> values_;  // [block_count * 8]
};

}  // namespace amhex
