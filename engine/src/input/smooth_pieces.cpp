#include "input/smooth_pieces.h"

#include <algorithm>
#include <cmath>

namespace amhex {
namespace {

constexpr double kSmallestAngle = 40.0 * 3.14159265358979323846 / 180;
constexpr double kLargestSpreadRatio = 0.18;
constexpr int kFewestSamples = 3;
constexpr int kRounds = 4;

double AngleBetween(const Vec3d& a, const Vec3d& b) {
  return std::atan2(Norm(Cross(a, b)), Dot(a, b));
}

class Splitter {
 public:
  Splitter(const std::vector<Vec3d>& normal, const std::vector<double>& weight)
      : normal_(normal), weight_(weight) {}

  // Parts the samples of piece `from` into `from` and `to`; undone if they hold together.
  bool Split(uint8_t from, uint8_t to, std::vector<uint8_t>& label) const {
    const std::vector<uint8_t> before = label;
    Vec3d mean_a = MeanNormal(from, label);
    // The normal farthest from the mean, then the one farthest from that.
    mean_a = Farthest(Farthest(mean_a, from, label), from, label);
    Vec3d mean_b = Farthest(mean_a, from, label);
    if (AngleBetween(mean_a, mean_b) < kSmallestAngle) return false;
    for (int round = 0; round < kRounds; ++round) {
      for (size_t i = 0; i < label.size(); ++i) {
        if (before[i] != from) continue;
        label[i] = Dot(normal_[i], mean_a) >= Dot(normal_[i], mean_b) ? from : to;
      }
      mean_a = MeanNormal(from, label), mean_b = MeanNormal(to, label);
    }
    const double angle = AngleBetween(mean_a, mean_b);
    const double spread = std::max(Spread(from, mean_a, label), Spread(to, mean_b, label));
    const bool apart = angle > kSmallestAngle && spread < kLargestSpreadRatio * angle &&
                       std::count(label.begin(), label.end(), from) >= kFewestSamples &&
                       std::count(label.begin(), label.end(), to) >= kFewestSamples;
    if (!apart) label = before;
    return apart;
  }

 private:
  Vec3d MeanNormal(uint8_t piece, const std::vector<uint8_t>& label) const {
    Vec3d sum;
    for (size_t i = 0; i < label.size(); ++i) {
      if (label[i] == piece) sum += normal_[i] * weight_[i];
    }
    return Normalized(sum);
  }

  Vec3d Farthest(const Vec3d& from, uint8_t piece, const std::vector<uint8_t>& label) const {
    Vec3d farthest = from;
    double least = 2;
    for (size_t i = 0; i < label.size(); ++i) {
      const double cosine = Dot(normal_[i], from);
      if (label[i] == piece && cosine < least) least = cosine, farthest = normal_[i];
    }
    return farthest;
  }

  // Root of the mean squared angle to the mean.
  double Spread(uint8_t piece, const Vec3d& mean, const std::vector<uint8_t>& label) const {
    double sum = 0, weights = 0;
    for (size_t i = 0; i < label.size(); ++i) {
      if (label[i] != piece) continue;
      const double angle = AngleBetween(normal_[i], mean);
      sum += weight_[i] * angle * angle;
      weights += weight_[i];
    }
    return weights > 0 ? std::sqrt(sum / weights) : 0;
  }

  const std::vector<Vec3d>& normal_;
  const std::vector<double>& weight_;
};

}  // namespace

SmoothPieces FindSmoothPieces(const std::vector<Vec3d>& position, const std::vector<Vec3d>& normal,
                              const std::vector<double>& weight) {
  SmoothPieces pieces;
  pieces.label.assign(normal.size(), 0);
  const Splitter splitter(normal, weight);
  if (!splitter.Split(0, 1, pieces.label)) return pieces;
  pieces.count = 2;
  if (splitter.Split(0, 2, pieces.label) || splitter.Split(1, 2, pieces.label)) pieces.count = 3;

  std::array<Vec3d, kMaxPieces> centre, direction;
  std::array<double, kMaxPieces> total{};
  for (size_t i = 0; i < normal.size(); ++i) {
    const size_t piece = pieces.label[i];
    centre[piece] += position[i] * weight[i];
    direction[piece] += normal[i] * weight[i];
    total[piece] += weight[i];
  }
  for (size_t a = 0; a < static_cast<size_t>(pieces.count); ++a) {
    centre[a] /= total[a];
    direction[a] = Normalized(direction[a]);
  }
  // Convex: each piece's centre lies below the other's plane.
  for (size_t a = 0; a < static_cast<size_t>(pieces.count); ++a) {
    for (size_t b = a + 1; b < static_cast<size_t>(pieces.count); ++b) {
      const Vec3d across = centre[b] - centre[a];
      pieces.is_convex[a][b] = Dot(across, direction[a]) - Dot(across, direction[b]) < 0;
    }
  }
  return pieces;
}

int DecidingPiece(const SmoothPieces& pieces, const std::array<double, kMaxPieces>& distance) {
  const auto combine = [&](int a, int b, bool convex) {
    const bool a_is_larger = distance[static_cast<size_t>(a)] >= distance[static_cast<size_t>(b)];
    return a_is_larger == convex ? a : b;
  };
  if (pieces.count == 1) return 0;
  if (pieces.count == 2) return combine(0, 1, pieces.is_convex[0][1]);
  // The pair that differs from the other two meets first: a ridge that runs into a wall, a groove
  // that runs out of a face.
  const bool c01 = pieces.is_convex[0][1], c02 = pieces.is_convex[0][2],
             c12 = pieces.is_convex[1][2];
  if (c02 == c12) return combine(combine(0, 1, c01), 2, c02);
  if (c01 == c12) return combine(combine(0, 2, c02), 1, c01);
  return combine(combine(1, 2, c12), 0, c01);
}

}  // namespace amhex
