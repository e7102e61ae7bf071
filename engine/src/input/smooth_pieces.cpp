#include "input/smooth_pieces.h"

#include <algorithm>
#include <cmath>

namespace amhex {
namespace {

constexpr double kSmallestAngle = 40.0 * 3.14159265358979323846 / 180;
constexpr double kLargestSpreadRatio = 0.18;
constexpr int kFewestSamples = 2;  // one may be an outlier
constexpr int kRounds = 4;

double AngleBetween(const Vec3d& a, const Vec3d& b) {
  return std::atan2(Norm(Cross(a, b)), Dot(a, b));
}

class Splitter {
 public:
  Splitter(const std::vector<Vec3d>& normal, const std::vector<double>& weight)
      : normal_(normal), weight_(weight) {}

  // No two groups can be apart if all normals lie within half of the smallest angle.
  bool IsSmooth() const {
    Vec3d sum;
    for (size_t i = 0; i < normal_.size(); ++i) sum += normal_[i] * weight_[i];
    const double least = std::cos(kSmallestAngle / 2) * Norm(sum);
    return std::all_of(normal_.begin(), normal_.end(),
                       [&](const Vec3d& n) { return Dot(n, sum) > least; });
  }

  // Groups the normals around `count` seeds (Lloyd's k-means on directions, started from normals
  // far from each other). False, with all labels 0, if the groups are not clearly apart.
  bool Split(int count, std::vector<uint8_t>& label) const {
    std::vector<Vec3d> seed = {MeanOf(label, 0)};
    seed[0] = Farthest(seed);
    while (static_cast<int>(seed.size()) < count) seed.push_back(Farthest(seed));
    for (int round = 0; round < kRounds; ++round) {
      int changes = round == 0 ? 1 : 0;  // the first means are of other labels
      for (size_t i = 0; i < label.size(); ++i) {
        const uint8_t nearest = Nearest(seed, normal_[i]);
        changes += nearest != label[i];
        label[i] = nearest;
      }
      if (changes == 0) break;
      for (size_t k = 0; k < seed.size(); ++k) seed[k] = MeanOf(label, static_cast<uint8_t>(k));
    }
    if (AreApart(seed, label)) return true;
    std::fill(label.begin(), label.end(), 0);
    return false;
  }

 private:
  bool AreApart(const std::vector<Vec3d>& mean, const std::vector<uint8_t>& label) const {
    double least_angle = 4;
    for (size_t a = 0; a < mean.size(); ++a) {
      for (size_t b = a + 1; b < mean.size(); ++b) {
        least_angle = std::min(least_angle, AngleBetween(mean[a], mean[b]));
      }
    }
    if (least_angle < kSmallestAngle) return false;
    for (size_t k = 0; k < mean.size(); ++k) {
      const auto piece = static_cast<uint8_t>(k);
      if (std::count(label.begin(), label.end(), piece) < kFewestSamples) return false;
      const double largest = kLargestSpreadRatio * least_angle;
      if (ChordSpread(piece, mean[k], label) > largest) return false;
      if (Spread(piece, mean[k], label) > largest) return false;
    }
    return true;
  }

  static uint8_t Nearest(const std::vector<Vec3d>& seed, const Vec3d& normal) {
    size_t best = 0;
    for (size_t k = 1; k < seed.size(); ++k) {
      if (Dot(seed[k], normal) > Dot(seed[best], normal)) best = k;
    }
    return static_cast<uint8_t>(best);
  }

  // The normal whose nearest seed is farthest.
  Vec3d Farthest(const std::vector<Vec3d>& seed) const {
    Vec3d farthest = seed[0];
    double least = 2;
    for (const Vec3d& normal : normal_) {
      const double cosine = Dot(normal, seed[Nearest(seed, normal)]);
      if (cosine < least) least = cosine, farthest = normal;
    }
    return farthest;
  }

  Vec3d MeanOf(const std::vector<uint8_t>& label, uint8_t piece) const {
    Vec3d sum;
    for (size_t i = 0; i < label.size(); ++i) {
      if (label[i] == piece) sum += normal_[i] * weight_[i];
    }
    return Normalized(sum);
  }

  // Root of the mean squared chord to the mean: less than the spread, and found without an angle.
  double ChordSpread(uint8_t piece, const Vec3d& mean, const std::vector<uint8_t>& label) const {
    double sum = 0, weights = 0;
    for (size_t i = 0; i < label.size(); ++i) {
      if (label[i] != piece) continue;
      sum += weight_[i] * SquaredNorm(normal_[i] - mean);
      weights += weight_[i];
    }
    return weights > 0 ? std::sqrt(sum / weights) : 0;
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
  if (splitter.IsSmooth()) return pieces;
  for (int count = 2; count <= kMaxPieces && pieces.count == 1; ++count) {
    if (splitter.Split(count, pieces.label)) pieces.count = count;
  }
  if (pieces.count == 1) return pieces;

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
