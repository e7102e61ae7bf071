// The nodes of a level in cubes of 2 x 2 x 2, eight slots to a cube whether the level has those
// nodes or not: a node's neighbours are in its own cube or in those beside it, in known lanes, so
// that matrices are applied to eight nodes at a time.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fields/background_grid.h"
#include "fields/linear_operators.h"
#include "fields/orientation_field.h"

namespace amhex::fields {

class NodeSlots {
 public:
  // An edge of the grid whose ends call their axes differently, seen from one end.
  struct RenamedEdge {
    uint8_t lane;  // of that end, in its cube
    uint8_t axis;  // of the grid
    uint8_t code;  // of the edge (octahedral_group.h)
  };
  struct RenamedEdges {
    const RenamedEdge* first;
    const RenamedEdge* last;
    const RenamedEdge* begin() const { return first; }
    const RenamedEdge* end() const { return last; }
  };
  enum class Side : uint8_t { kAhead, kBehind };

  // O(nodes). What a stopped run leaves is not to be used.
  NodeSlots(const GridLevel& level, const ForwardCodes& codes, const RunContext& run);

  int64_t node_count() const { return static_cast<int64_t>(slot_of_node_.size()); }
  int64_t cube_count() const { return static_cast<int64_t>(beside_.size()); }
  int64_t count() const { return kCubeSlots * cube_count(); }
  int64_t SlotOf(int64_t node) const { return slot_of_node_[node]; }
  int64_t NodeOf(int64_t slot) const { return node_of_slot_[slot]; }  // -1 = none

  // Edges from the nodes of `cube` to those ahead of or behind them.
  RenamedEdges Renamed(int64_t cube, Side side) const {
    const Renamings& all = renamings_[static_cast<size_t>(side)];
    return {all.edges.data() + all.first[cube], all.edges.data() + all.first[cube + 1]};
  }
  // The numbers of the cube beside `cube` along `axis` in an array of so many per cube; zeros where
  // there is none.
  const float* Beside(Side side, int axis, int64_t cube, const float* array,
                      int64_t per_cube) const {
    const int64_t other = beside_[cube][3 * static_cast<size_t>(side) + static_cast<size_t>(axis)];
    return other < 0 ? kNothing.data() : array + per_cube * other;
  }

 private:
  struct Renamings {
    std::vector<int32_t> first;  // [cube_count + 1]
    std::vector<RenamedEdge> edges;
  };
  // Room for the most numbers per cube that any matrix has.
  static constexpr std::array<float, kCubeSlots * ClosureOperator::kUnknowns> kNothing{};

  void LinkCubes(const GridLevel& level);
  void ListRenamed(const GridLevel& level, const ForwardCodes& codes);

  std::vector<int32_t> slot_of_node_;
  std::vector<int32_t> node_of_slot_;
  std::vector<std::array<int32_t, 6>> beside_;  // along +x +y +z -x -y -z, -1 = none
  std::array<Renamings, 2> renamings_;          // by side
};

// The links of linear_operators.h between slots.
class SlotLinks {
 public:
  SlotLinks(const NodeSlots& slots, const GridLevel& level, const ForwardCodes& codes,
            const RunContext& run);
  NodeLinks View() const;

 private:
  std::vector<int32_t> neighbours_;
  std::vector<uint8_t> codes_;
};

}  // namespace amhex::fields
