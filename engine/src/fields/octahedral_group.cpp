#include "fields/octahedral_group.h"

#include <algorithm>
#include <numbers>

namespace amhex::fields {
namespace {

constexpr double kHalfRoot2 = std::numbers::sqrt2 / 2;
// cos of half of 45 degrees: nearer than this no other element of the group can be nearer.
constexpr double kSurelyIdentity = 0.9238795325112867;

constexpr std::array<std::array<int, 2>, 6> kPairs{
    {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

Quaternion FromComponents(const std::array<double, 4>& c) { return {c[0], c[1], c[2], c[3]}; }

Quaternion RotationOfCode(int code) {
  std::array<double, 4> c{};
  if (code < kFirstPairCode) {
    c[code] = 1;
  } else if (code < kFirstCornerCode) {
    const auto& pair = kPairs[(code - kFirstPairCode) / 2];
    c[pair[0]] = kHalfRoot2;
    c[pair[1]] = (code & 1) != 0 ? -kHalfRoot2 : kHalfRoot2;
  } else {
    c[0] = 0.5;
    for (int k = 0; k < 3; ++k) c[k + 1] = ((code - kFirstCornerCode) >> k & 1) != 0 ? -0.5 : 0.5;
  }
  return FromComponents(c);
}

std::array<Quaternion, kRotationCount> MakeQuaternions() {
  std::array<Quaternion, kRotationCount> all;
  for (int code = 0; code < kRotationCount; ++code) all[code] = RotationOfCode(code);
  return all;
}

const std::array<Quaternion, kRotationCount> kQuaternions = MakeQuaternions();

std::array<AxisRotation, kRotationCount> MakeRotations() {
  std::array<AxisRotation, kRotationCount> all;
  for (int code = 0; code < kRotationCount; ++code) {
    const AxisFrame frame = ToFrame(RotationOfCode(code));
    for (int column = 0; column < 3; ++column) {
      for (int row = 0; row < 3; ++row) {
        const double entry = frame.axis[column][row];
        if (std::abs(entry) < 0.5) continue;
        all[code].source[row] = static_cast<int8_t>(column);
        all[code].sign[row] = entry > 0 ? 1 : -1;
      }
    }
  }
  return all;
}

std::array<uint8_t, kRotationCount> MakeInverses() {
  std::array<uint8_t, kRotationCount> all{};
  for (int code = 0; code < kRotationCount; ++code) {
    all[code] = static_cast<uint8_t>(NearestRotation(Conjugate(RotationOfCode(code))));
  }
  return all;
}

}  // namespace

const std::array<AxisRotation, kRotationCount> kAxisRotations = MakeRotations();
const std::array<uint8_t, kRotationCount> kInverseCodes = MakeInverses();

AxisRotation Compose(const AxisRotation& a, const AxisRotation& b) {
  AxisRotation r;
  for (int k = 0; k < 3; ++k) {
    r.source[k] = b.source[a.source[k]];
    r.sign[k] = static_cast<int8_t>(a.sign[k] * b.sign[a.source[k]]);
  }
  return r;
}

Quaternion AddAligned(const Quaternion& a, const Quaternion& b, double weight) {
  const double w = Dot(a, b) < 0 ? -weight : weight;
  return {a.w + b.w * w, a.x + b.x * w, a.y + b.y * w, a.z + b.z * w};
}

Quaternion Matched(const Quaternion& reference, const Quaternion& q) {
  const double w = Dot(reference, q);
  if (w * w >= kSurelyIdentity * kSurelyIdentity * Dot(reference, reference)) return q;
  const int code = NearestRotation(Multiply(Conjugate(reference), q));
  return code == 0 ? q : Multiply(q, Conjugate(kQuaternions[code]));
}

Quaternion AlignedToNormal(const Quaternion& q, const Vec3d& normal) {
  const AxisFrame frame = ToFrame(q);
  Vec3d axis = frame.axis[0];
  double cosine = Dot(axis, normal);
  for (int k = 1; k < 3; ++k) {
    const double c = Dot(frame.axis[k], normal);
    if (std::abs(c) > std::abs(cosine)) cosine = c, axis = frame.axis[k];
  }
  if (cosine < 0) axis = -axis, cosine = -cosine;
  // Half-angle form: the nearest axis is within 55 degrees, so 1 + cosine stays away from zero.
  const Vec3d turn = Cross(axis, normal);
  return Multiply(Normalized(Quaternion{1 + cosine, turn.x, turn.y, turn.z}), q);
}

}  // namespace amhex::fields
