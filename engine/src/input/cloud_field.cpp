#include "input/cloud_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "input/winding_in_lanes.h"

namespace amhex {
namespace {

HullQueries QueriesOf(const TriangleMesh& mesh) { return {mesh.vertices, mesh.triangles}; }

constexpr int kNeighbours = 28;
// Radius of the samples' influence, in the mean spacing of this many nearest ones: random samples
// need some 20 in reach.
constexpr double kInfluenceRatio = 2.8;
constexpr size_t kSpacingNeighbours = 8;
// Distance from the nearest sample, in its spacing, up to which the samples alone decide, and from
// which on the winding number does.
constexpr double kNearRatio = 1.3;
constexpr double kFarRatio = 2.6;
// This near to a sample its plane decides alone; farther off, a winding number below the first
// bound is outside and one above the second is inside, whatever the planes say: less than at the
// tip of most corners, more than in the bottom of most grooves.
constexpr double kTrustedRatio = 0.5;
constexpr double kSurelyOutside = 0.1;
constexpr double kSurelyInside = 0.9;
// Farther from the planes than this share of the samples' reach, the surface is none of theirs.
constexpr double kOffPlanes = 0.05;
// Robustness of Oztireli et al.: widths for residuals, in the sample's radius, and for normals.
constexpr double kResidualWidth = 0.5;
constexpr double kNormalWidth = 0.8;
constexpr int kIterations = 3;
// Samples whose influence is about to end add nothing but rounding errors.
constexpr double kLeastFall = 1e-3;

}  // namespace

CloudField::CloudField(CloudSamples samples)
    : samples_(std::move(samples)),
      tree_(samples_.position),
      discs_(QueriesOf(DiscSoup(samples_))) {}

// The samples that reach a point, and by how much.
struct CloudField::Reach {
  std::vector<int32_t> sample;
  std::vector<Vec3d> position, normal;
  std::vector<double> weight;  // of the smooth falloff alone
  std::vector<double> fall;    // 1 - (distance / radius)^2
  double radius = 0;
};

// Robust implicit moving least squares over one smooth piece.
void CloudField::FitPiece(const Vec3d& p, const Reach& reach, const SmoothPieces& pieces,
                          uint8_t piece, Local& local) {
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    double weights = 0, weighted_values = 0;
    Vec3d weight_gradient, value_gradient, normals;
    for (size_t i = 0; i < reach.sample.size(); ++i) {
      if (pieces.label[i] != piece) continue;
      const Vec3d offset = p - reach.position[i];
      const double value = Dot(offset, reach.normal[i]);
      double trust = 1;
      if (iteration > 0) {
        const double residual = (value - local.distance) / (kResidualWidth * reach.radius);
        const double turn = Norm(reach.normal[i] - local.gradient) / kNormalWidth;
        trust = std::exp(-residual * residual - turn * turn);
      }
      const double weight = trust * reach.weight[i];
      const Vec3d gradient = offset * (-8 * weight / (reach.fall[i] * reach.radius * reach.radius));
      weights += weight, weighted_values += weight * value;
      weight_gradient += gradient, value_gradient += gradient * value;
      normals += reach.normal[i] * weight;
    }
    if (!(weights > 1e-12)) break;
    local.is_near = true;
    local.distance = weighted_values / weights;
    local.gradient = (value_gradient - weight_gradient * local.distance + normals) / weights;
  }
}

CloudField::Local CloudField::MovingLeastSquares(
    const Vec3d& p, const std::vector<PointTree::Neighbour>& near) const {
  const auto nearest = static_cast<size_t>(near.front().index);
  Local local;
  const size_t spacing_count = std::min(near.size(), kSpacingNeighbours);
  for (size_t k = 0; k < spacing_count; ++k) {
    local.unit += kInfluenceRatio * samples_.spacing[static_cast<size_t>(near[k].index)];
  }
  local.unit /= static_cast<double>(spacing_count);
  local.ratio = std::sqrt(near.front().squared_distance) / samples_.spacing[nearest];
  local.nearness = std::clamp((kFarRatio - local.ratio) / (kFarRatio - kNearRatio), 0.0, 1.0);
  if (local.nearness <= 0) return local;
  Reach reach;
  reach.radius = local.unit;
  for (const auto& n : near) {
    const auto i = static_cast<size_t>(n.index);
    const double fall = 1 - n.squared_distance / (reach.radius * reach.radius);
    if (fall <= kLeastFall) continue;
    reach.sample.push_back(n.index);
    reach.position.push_back(samples_.position[i]);
    reach.normal.push_back(samples_.normal[i]);
    reach.weight.push_back(fall * fall * fall * fall);
    reach.fall.push_back(fall);
  }
  if (reach.sample.empty()) return local;
  const SmoothPieces pieces = FindSmoothPieces(reach.position, reach.normal, reach.weight);
  std::array<Local, kMaxPieces> fits;
  std::array<double, kMaxPieces> distance{};
  for (int piece = 0; piece < pieces.count; ++piece) {
    Local& fit = fits[static_cast<size_t>(piece)];
    fit = local;
    FitPiece(p, reach, pieces, static_cast<uint8_t>(piece), fit);
    distance[static_cast<size_t>(piece)] = fit.distance;
  }
  return fits[static_cast<size_t>(DecidingPiece(pieces, distance))];
}

bool CloudField::IsByPlanes(const Local& local) {
  return local.is_near && local.ratio < kTrustedRatio;
}

double CloudField::ValueOf(const Local& local, const Vec3d& p) const {
  return IsByPlanes(local) ? local.distance : ValueOf(local, discs_.WindingNumber(p));
}

double CloudField::ValueOf(const Local& local, double winding) {
  const double by_winding = (0.5 - winding) * local.unit;
  if (!local.is_near) return by_winding;
  const double value = local.nearness * local.distance + (1 - local.nearness) * by_winding;
  return std::min(std::max(value, (kSurelyOutside - winding) * local.unit),
                  (kSurelyInside - winding) * local.unit);
}

template <class Ask>
Vec3d CloudField::NormalBy(const Vec3d& p, double spacing, const Ask& local_at) const {
  const Local local = local_at(p);
  const bool is_of_planes =
      local.is_near && local.nearness >= 1 && std::abs(local.distance) < kOffPlanes * local.unit;
  if (is_of_planes && Norm(local.gradient) > 0.1) return Normalized(local.gradient);
  const double step = spacing / 4;
  const auto value = [&](const Vec3d& q) { return ValueOf(local_at(q), q); };
  const auto slope = [&](const Vec3d& d) { return value(p + d) - value(p - d); };
  return Normalized(Vec3d{slope({step, 0, 0}), slope({0, step, 0}), slope({0, 0, step})});
}

CloudField::Local CloudField::LocalAt(const Vec3d& p) const {
  std::vector<PointTree::Neighbour> near;
  tree_.Nearest(p, kNeighbours, near);
  return MovingLeastSquares(p, near);
}

double CloudField::Value(const Vec3d& p) const { return ValueOf(LocalAt(p), p); }

Vec3d CloudField::Normal(const Vec3d& p, double spacing) const {
  return NormalBy(p, spacing, [this](const Vec3d& at) { return LocalAt(at); });
}

// Knows all samples that can be among the nearest of a point within its reach, and what they said
// last: after the value at a point its normal is asked for. For one thread at a time.
class CloudField::Part : public SurfaceField {
 public:
  Part(const CloudField& field, const Vec3d& centre, double reach)
      : field_(field), centre_(centre), squared_reach_(reach * reach) {
    field.tree_.Nearest(centre, kNeighbours, candidates_);
    // A point is at most `reach` farther from the centre's neighbours than the centre is, so that
    // its own lie at most twice that farther from the centre.
    const double radius = std::sqrt(candidates_.back().squared_distance) + 2 * reach;
    field.tree_.Within(centre, radius * (1 + kRounding), candidates_);
  }

  double Value(const Vec3d& p) const override {
    last_ = {p, LocalAt(p)};
    return field_.ValueOf(last_->second, p);
  }
  EightValues Values(const EightPoints& p) const override {
    std::array<Local, 8> local;
    EightPoints asked;
    int count = 0;
    for (size_t i = 0; i < p.size(); ++i) {
      local[i] = LocalAt(p[i]);
      if (!IsByPlanes(local[i])) asked[static_cast<size_t>(count++)] = p[i];
    }
    const EightValues winding = WindingNumbers(field_.discs_.view(), asked.data(), count);
    EightValues values;
    size_t next = 0;
    for (size_t i = 0; i < p.size(); ++i) {
      values[i] = IsByPlanes(local[i]) ? local[i].distance : ValueOf(local[i], winding[next++]);
    }
    return values;
  }
  Vec3d Normal(const Vec3d& p, double spacing) const override {
    return field_.NormalBy(p, spacing, [this](const Vec3d& at) {
      return last_.has_value() && last_->first == at ? last_->second : LocalAt(at);
    });
  }

 private:
  static constexpr double kRounding = 1e-9;

  Local LocalAt(const Vec3d& p) const {
    if (SquaredNorm(p - centre_) > squared_reach_) return field_.LocalAt(p);
    near_ = candidates_;
    for (PointTree::Neighbour& n : near_) {
      n.squared_distance = SquaredNorm(field_.samples_.position[static_cast<size_t>(n.index)] - p);
    }
    const size_t count = std::min<size_t>(kNeighbours, near_.size());
    const auto last = near_.begin() + static_cast<std::ptrdiff_t>(count) - 1;
    std::nth_element(near_.begin(), last, near_.end());
    near_.resize(count);
    std::sort(near_.begin(), near_.end());
    return field_.MovingLeastSquares(p, near_);
  }

  const CloudField& field_;
  const Vec3d centre_;
  const double squared_reach_;
  std::vector<PointTree::Neighbour> candidates_;
  mutable std::vector<PointTree::Neighbour> near_;  // kept for its memory
  mutable std::optional<std::pair<Vec3d, Local>> last_;
};

std::unique_ptr<SurfaceField> CloudField::Around(const Vec3d& centre, double reach) const {
  return std::make_unique<Part>(*this, centre, reach);
}

}  // namespace amhex
