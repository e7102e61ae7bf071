#include "fields/frame_lanes.h"

namespace amhex::fields {
namespace {

LaneRotation ForLanes(const AxisRotation& rotation) {
  LaneRotation lanes{};
  for (int c = 6; c < 8; ++c) lanes.phase_source[c] = lanes.phase_inverse[c] = c;
  for (int to = 0; to < 3; ++to) {
    const int from = rotation.source[to];
    const auto sign = static_cast<float>(rotation.sign[to]);
    for (int part = 0; part < 2; ++part) {
      lanes.phase_source[2 * to + part] = 2 * from + part;
      lanes.phase_inverse[2 * from + part] = 2 * to + part;
      lanes.conjugation[2 * to + part] = part == 0 ? 1.0F : sign;
    }
  }
  return lanes;
}

std::array<LaneRotation, kRotationCount> MakeLaneRotations() {
  std::array<LaneRotation, kRotationCount> all;
  for (int code = 0; code < kRotationCount; ++code) all[code] = ForLanes(kAxisRotations[code]);
  return all;
}

}  // namespace

const std::array<LaneRotation, kRotationCount>& LaneRotations() {
  static const std::array<LaneRotation, kRotationCount> kRotations = MakeLaneRotations();
  return kRotations;
}

}  // namespace amhex::fields
