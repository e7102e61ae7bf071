#include "fields/node_slots.h"

#include "fields/field_loops.h"
#include "fields/node_links.h"

namespace amhex::fields {

NodeSlots::NodeSlots(const GridLevel& level, const ForwardCodes& codes, const RunContext& run)
    : slot_of_node_(level.count()) {
  constexpr uint64_t kLanes = kCubeSlots - 1;
  for (int64_t i = 0; i < level.count(); ++i) {
    if (i % kLoopGrain == 0 && run.ShouldStop()) break;
    if (i == 0 || (level.key[i] & ~kLanes) != (level.key[i - 1] & ~kLanes)) {
      node_of_slot_.resize(node_of_slot_.size() + kCubeSlots, -1);
    }
    const int64_t cube = static_cast<int64_t>(node_of_slot_.size()) / kCubeSlots - 1;
    const int64_t slot = kCubeSlots * cube + static_cast<int64_t>(level.key[i] & kLanes);
    slot_of_node_[i] = static_cast<int32_t>(slot);
    node_of_slot_[slot] = static_cast<int32_t>(i);
  }
  beside_.assign(node_of_slot_.size() / kCubeSlots, {-1, -1, -1, -1, -1, -1});
  if (run.ShouldStop()) return;
  LinkCubes(level);
  ListRenamed(level, codes);
}

void NodeSlots::LinkCubes(const GridLevel& level) {
  for (int64_t i = 0; i < level.count(); ++i) {
    const int32_t cube = slot_of_node_[i] / static_cast<int32_t>(kCubeSlots);
    for (int d = 0; d < 3; ++d) {
      const int32_t j = level.neighbours[i][d];
      if (j < 0) continue;
      const int32_t other = slot_of_node_[j] / static_cast<int32_t>(kCubeSlots);
      if (other == cube) continue;
      beside_[cube][d] = other;
      beside_[other][3 + d] = cube;
    }
  }
}

void NodeSlots::ListRenamed(const GridLevel& level, const ForwardCodes& codes) {
  for (Renamings& all : renamings_) all.first.reserve(beside_.size() + 1);
  Renamings &ahead = renamings_[0], &behind = renamings_[1];
  for (int64_t slot = 0; slot < count(); ++slot) {
    if (slot % kCubeSlots == 0) {
      for (Renamings& all : renamings_) all.first.push_back(static_cast<int32_t>(all.edges.size()));
    }
    const int32_t node = node_of_slot_[slot];
    if (node < 0) continue;
    const auto lane = static_cast<uint8_t>(slot % kCubeSlots);
    for (uint8_t d = 0; d < 3; ++d) {
      if (level.neighbours[node][d] >= 0 && codes[node][d] != 0) {
        ahead.edges.push_back({lane, d, codes[node][d]});
      }
      const int32_t j = level.neighbours[node][Opposite(d)];
      if (j >= 0 && codes[j][d] != 0) behind.edges.push_back({lane, d, codes[j][d]});
    }
  }
  for (Renamings& all : renamings_) all.first.push_back(static_cast<int32_t>(all.edges.size()));
}

SlotLinks::SlotLinks(const NodeSlots& slots, const GridLevel& level, const ForwardCodes& codes,
                     const RunContext& run)
    : neighbours_(6 * slots.count(), -1), codes_(3 * slots.count(), 0) {
  ForEach(run, level.count(), [&](int64_t i) {
    const int64_t slot = slots.SlotOf(i);
    for (int d = 0; d < 3; ++d) {
      const int32_t ahead = level.neighbours[i][d], behind = level.neighbours[i][Opposite(d)];
      if (ahead >= 0) neighbours_[6 * slot + d] = static_cast<int32_t>(slots.SlotOf(ahead));
      if (behind >= 0) neighbours_[6 * slot + 3 + d] = static_cast<int32_t>(slots.SlotOf(behind));
      codes_[3 * slot + d] = codes[i][d];
    }
  });
}

NodeLinks SlotLinks::View() const {
  return {{neighbours_.data(), static_cast<int64_t>(neighbours_.size())},
          {codes_.data(), static_cast<int64_t>(codes_.size())},
          RenamingsByCode()};
}

}  // namespace amhex::fields
