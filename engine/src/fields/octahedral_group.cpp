#include "fields/octahedral_group.h"

#include <algorithm>
#include <numbers>

namespace amhex::fields {
namespace {

constexpr double kHalfRoot2 = std::numbers::sqrt2 / 2;
// cos of half of 45 degrees: nearer than this no other element of the group can be nearer.
constexpr double kSurelyIdentity = 0.9238795325112867;

// Codes: 0..3 one component of the quaternion is 1; 4..15 two are equal in size (six pairs, signs
// equal or opposed); 16..23 all four are (signs of x, y, z against w).
constexpr std::array<std::array<int, 2>, 6> kPairs{
    {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};
constexpr std::array<std::array<int, 4>, 4> kPairIndex{
    {{-1, 0, 1, 2}, {0, -1, 3, 4}, {1, 3, -1, 5}, {2, 4, 5, -1}}};

Quaternion FromComponents(const std::array<double, 4>& c) { return {c[0], c[1], c[2], c[3]}; }

Quaternion RotationOfCode(int code) {
  std::array<double, 4> c{};
  if (code < 4) {
    c[code] = 1;
  } else if (code < 16) {
    const auto& pair = kPairs[(code - 4) / 2];
    c[pair[0]] = kHalfRoot2;
    c[pair[1]] = (code & 1) != 0 ? -kHalfRoot2 : kHalfRoot2;
  } else {
    c[0] = 0.5;
    for (int k = 0; k < 3; ++k) c[k + 1] = ((code - 16) >> k & 1) != 0 ? -0.5 : 0.5;
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

Quaternion Multiply(const Quaternion& a, const Quaternion& b) {
  return {
      a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
      a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

Quaternion AddAligned(const Quaternion& a, const Quaternion& b, double weight) {
  const double w = Dot(a, b) < 0 ? -weight : weight;
  return {a.w + b.w * w, a.x + b.x * w, a.y + b.y * w, a.z + b.z * w};
}

int NearestRotation(const Quaternion& q) {
  const std::array<double, 4> c{q.w, q.x, q.y, q.z};
  int first = 0;
  for (int k = 1; k < 4; ++k) {
    if (std::abs(c[k]) > std::abs(c[first])) first = k;
  }
  int second = first == 0 ? 1 : 0;
  for (int k = 0; k < 4; ++k) {
    if (k != first && std::abs(c[k]) > std::abs(c[second])) second = k;
  }
  const double one = std::abs(c[first]);
  const double two = (one + std::abs(c[second])) * kHalfRoot2;
  const double four = 0.5 * (std::abs(c[0]) + std::abs(c[1]) + std::abs(c[2]) + std::abs(c[3]));
  if (one >= two && one >= four) return first;
  if (two >= four) {
    const bool opposed = (c[first] < 0) != (c[second] < 0);
    return 4 + 2 * kPairIndex[first][second] + (opposed ? 1 : 0);
  }
  int code = 16;
  for (int k = 0; k < 3; ++k) code += (c[k + 1] < 0) != (c[0] < 0) ? 1 << k : 0;
  return code;
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
