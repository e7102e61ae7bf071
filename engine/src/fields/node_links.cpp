#include "fields/node_links.h"

#include <array>

namespace amhex::fields {
namespace {

AxisRenaming RenamingOf(const AxisRotation& rotation) {
  AxisRenaming renaming{};
  for (int to = 0; to < 3; ++to) {
    const auto from = static_cast<uint8_t>(rotation.source[to]);
    const auto sign = static_cast<float>(rotation.sign[to]);
    renaming.source[to] = from;
    renaming.inverse[from] = static_cast<uint8_t>(to);
    renaming.sign[to] = renaming.inverse_sign[from] = sign;
  }
  return renaming;
}

const std::array<AxisRenaming, kRotationCount>& Renamings() {
  static const std::array<AxisRenaming, kRotationCount> kRenamings = [] {
    std::array<AxisRenaming, kRotationCount> all;
    for (int code = 0; code < kRotationCount; ++code) all[code] = RenamingOf(kAxisRotations[code]);
    return all;
  }();
  return kRenamings;
}

}  // namespace

ArrayView<const AxisRenaming> RenamingsByCode() { return {Renamings().data(), kRotationCount}; }

OwnedLinks::OwnedLinks(const GridLevel& level, const ForwardCodes& codes, const RunContext& run)
    : neighbours_(6 * level.count()), codes_(codes) {
  ForEach(run, level.count(), [&](int64_t i) {
    for (int d = 0; d < 3; ++d) {
      neighbours_[6 * i + d] = level.neighbours[i][d];
      neighbours_[6 * i + 3 + d] = level.neighbours[i][Opposite(d)];
    }
  });
}

NodeLinks OwnedLinks::View() const {
  return {{neighbours_.data(), static_cast<int64_t>(neighbours_.size())},
          {codes_.data()->data(), static_cast<int64_t>(3 * codes_.size())},
          RenamingsByCode()};
}

}  // namespace amhex::fields
