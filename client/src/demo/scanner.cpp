#include "demo/scanner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "absl/strings/str_cat.h"

namespace amhex::client {
namespace {

constexpr double kDefaultNoisePerDiagonal = 0.0003;
constexpr double kNoiseCutoff = 3;        // deviations
constexpr double kLeastIncidence = 0.2;   // cosine between ray and normal
constexpr double kScannerDistance = 1.5;  // from the centre, in box diagonals
constexpr int64_t kRaysPerPoint = 40;     // tried before a scanner gives up its share
constexpr int64_t kFewestPoints = 100, kMostPoints = 10'000'000;

// Numbers that depend on (seed, stream, index) alone: splitmix64's finaliser.
uint64_t Hash(uint64_t seed, uint64_t stream, uint64_t index) {
  uint64_t x = seed * 0x9e3779b97f4a7c15ULL ^ (stream + 1) * 0xbf58476d1ce4e5b9ULL ^
               (index + 1) * 0x94d049bb133111ebULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

double Uniform(uint64_t seed, uint64_t stream, uint64_t index) {
  return (static_cast<double>(Hash(seed, stream, index) >> 11) + 0.5) / 9007199254740992.0;
}

// Standard normal, cut off at kNoiseCutoff (Box and Muller).
double Gaussian(uint64_t seed, uint64_t stream, uint64_t index) {
  const double u = Uniform(seed, stream, 2 * index), v = Uniform(seed, stream, 2 * index + 1);
  const double value = std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
  return std::clamp(value, -kNoiseCutoff, kNoiseCutoff);
}

Vec3d ScannerDirection(int scanner) {
  if (scanner < 6) {
    Vec3d axis;
    axis[scanner / 2] = scanner % 2 == 0 ? -1 : 1;
    return axis;
  }
  const int corner = scanner - 6;
  return Normalized(
      Vec3d{corner & 1 ? 1.0 : -1.0, corner & 2 ? 1.0 : -1.0, corner & 4 ? 1.0 : -1.0});
}

// Where the ray first meets the surface within `reach`; nullopt if it misses.
std::optional<Vec3d> Trace(const Shape& shape, const Vec3d& origin, const Vec3d& direction,
                           double reach) {
  constexpr int kMostSteps = 400;
  constexpr double kTolerance = 1e-9;  // of the reach
  constexpr double kStepFactor = 0.7;  // below 1 / sqrt(2), the bound of Shape::distance
  double t = 0;
  for (int step = 0; step < kMostSteps && t < reach; ++step) {
    const double distance = shape.distance(origin + direction * t);
    if (distance < kTolerance * reach) return origin + direction * t;
    t += kStepFactor * distance;
  }
  return std::nullopt;
}

class Scanner {
 public:
  Scanner(const Shape& shape, uint64_t seed, int number)
      : shape_(shape), seed_(seed), number_(number) {
    centre_ = (shape.box.low + shape.box.high) / 2.0;
    radius_ = shape.box.Diagonal() / 2;
    const Vec3d direction = ScannerDirection(number);
    position_ = centre_ + direction * (kScannerDistance * shape.box.Diagonal());
    const Vec3d helper = std::abs(direction.z) < 0.9 ? Vec3d{0, 0, 1} : Vec3d{1, 0, 0};
    right_ = Normalized(Cross(direction, helper));
    up_ = Cross(right_, direction);
  }

  // The hit of the ray-th ray, rays spread evenly over the disc that the shape fills.
  std::optional<Vec3d> Hit(int64_t ray) const {
    // The additive sequence of the plastic number covers the square without lumps.
    constexpr double kAlpha = 0.7548776662466927, kBeta = 0.5698402909980532;
    const double index = static_cast<double>(ray);
    const auto stream = static_cast<uint64_t>(number_);
    const double a = std::fmod(Uniform(seed_, stream, 0) + kAlpha * index, 1.0) * 2 - 1;
    const double b = std::fmod(Uniform(seed_, stream, 1) + kBeta * index, 1.0) * 2 - 1;
    const Vec3d aim = centre_ + (right_ * a + up_ * b) * radius_;
    const Vec3d direction = Normalized(aim - position_);
    const std::optional<Vec3d> hit =
        Trace(shape_, position_, direction, 2 * kScannerDistance * shape_.box.Diagonal());
    if (hit && -Dot(direction, NormalAt(shape_, *hit)) < kLeastIncidence) return std::nullopt;
    return hit;
  }

 private:
  const Shape& shape_;
  uint64_t seed_;
  int number_;
  Vec3d centre_, position_, right_, up_;
  double radius_ = 0;
};

Vec3d GaussianVector(uint64_t seed, uint64_t stream, uint64_t index) {
  return {Gaussian(seed, stream, 3 * index), Gaussian(seed, stream, 3 * index + 1),
          Gaussian(seed, stream, 3 * index + 2)};
}

absl::Status CheckOptions(const ScanOptions& options) {
  if (options.point_count < kFewestPoints || options.point_count > kMostPoints) {
    return absl::InvalidArgumentError(absl::StrCat("the number of points must be in [",
                                                   kFewestPoints, ", ", kMostPoints, "], got ",
                                                   options.point_count));
  }
  if (!std::isfinite(options.noise) || (options.noise < 0 && options.noise != -1)) {
    return absl::InvalidArgumentError(
        absl::StrCat("the noise must be at least 0, got ", options.noise));
  }
  if (!(options.normal_noise >= 0 && options.normal_noise <= 1)) {
    return absl::InvalidArgumentError(
        absl::StrCat("the normals' noise must be in [0, 1], got ", options.normal_noise));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Scan> ScanShape(const Shape& shape, const ScanOptions& options) {
  const absl::Status valid = CheckOptions(options);
  if (!valid.ok()) return valid;
  Scan scan;
  scan.noise = options.noise < 0 ? kDefaultNoisePerDiagonal * shape.box.Diagonal() : options.noise;
  // Streams beyond the scanners' own.
  constexpr uint64_t kPositionStream = 100, kNormalStream = 101;
  for (int number = 0; number < kScannerCount; ++number) {
    const Scanner scanner(shape, options.seed, number);
    const int64_t share = options.point_count * (number + 1) / kScannerCount -
                          options.point_count * number / kScannerCount;
    int64_t found = 0;
    for (int64_t ray = 0; found < share && ray < kRaysPerPoint * share; ++ray) {
      const std::optional<Vec3d> hit = scanner.Hit(ray);
      if (!hit) continue;
      const uint64_t index = scan.cloud.points.size();
      scan.cloud.points.push_back(*hit + GaussianVector(options.seed, kPositionStream, index) *
                                             scan.noise);
      scan.cloud.normals.push_back(
          Normalized(NormalAt(shape, *hit) +
                     GaussianVector(options.seed, kNormalStream, index) * options.normal_noise));
      scan.scanner_of.push_back(number);
      ++found;
    }
  }
  return scan;
}

}  // namespace amhex::client
