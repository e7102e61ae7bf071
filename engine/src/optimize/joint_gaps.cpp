#include "optimize/joint_gaps.h"

#include <algorithm>
#include <cmath>

#include "base/sort_unique.h"
#include "base/vector_lanes.h"
#include "input/hull_queries.h"
#include "input/triangle_math.h"
#include "optimize/face_places.h"

namespace amhex {
namespace {

// A vertex that is farther off the hull was not taken there by drawing: what is nearest to it need
// not be where it belongs.
constexpr double kMostOffHullAtFirst = 0.5;
// What is aimed at, of the limits: samples are not everywhere.
constexpr double kAim = 0.9;
// Points of the input farther off the hull are not followed: vertices may be as far off it as
// does not count, and what they come near to may be so far from them again.
constexpr double kMostOffHull = 2;
constexpr double kNowhere = 1e100;  // coordinate of what fills up the last lanes
constexpr double kSeenShare = 0.7;  // of the aim: what a step might bring beyond it

// Weights of a, b, c in a point of their triangle.
std::array<double, 3> WeightsAt(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d normal = Cross(b - a, c - a);
  const double squared = SquaredNorm(normal);
  if (!(squared > 0)) return {1, 0, 0};
  const double of_b = Dot(Cross(p - a, c - a), normal) / squared;
  const double of_c = Dot(Cross(b - a, p - a), normal) / squared;
  return {1 - of_b - of_c, of_b, of_c};
}

AMHEX_LANES_INLINE HalfLanes LanesAt(const std::vector<double>& numbers, size_t block) {
  return *reinterpret_cast<const HalfLanes*>(&numbers[block * kHalfLanes]);
}

}  // namespace

JointGaps::JointGaps(const HullSampling& sampling, const Placement& placement,
                     const DeviationLimits& limits, FaceDetail detail)
    : sampling_(sampling), placement_(placement), limits_(limits), detail_(detail) {}

JointGaps::Face JointGaps::FaceNow(int32_t f) const {
  const CellFace& face = placement_.complex.hull_faces[f];
  Face now;
  now.count = face.count;
  for (int j = 0; j < face.count; ++j) {
    now.vertex[j] = face.v[j];
    now.corner[j] = placement_.complex.vertices[face.v[j]];
    now.middle += now.corner[j] / static_cast<double>(face.count);
  }
  for (int j = 0; j < face.count; ++j) {
    now.extent = std::max(now.extent, Norm(now.corner[j] - now.middle));
  }
  now.lanes = FaceInLanes(now.corner.data(), now.count, now.middle);
  return now;
}

void JointGaps::Renew() {
  for (size_t i = 0; i < own_ids_.size(); ++i) {
    faces_[i] = FaceNow(own_ids_[i]);
    NoteBall(i);
  }
}

bool JointGaps::Enter(const std::vector<int32_t>& moving) {
  moving_.clear(), own_ids_.clear(), own_divisions_.clear(), faces_.clear(), samples_.clear(),
      crease_samples_.clear(), likely_.clear();
  Box3d box;
  for (const int32_t v : moving) {
    const auto faces = placement_.neighbourhoods.hull_faces[v];
    if (faces.size() == 0) continue;
    const Vec3d& place = placement_.complex.vertices[v];
    if (!sampling_.hull().queries->IsWithin(place, kMostOffHullAtFirst)) return false;
    moving_.push_back(v);
    own_ids_.insert(own_ids_.end(), faces.begin(), faces.end());
  }
  SortUnique(own_ids_);
  if (own_ids_.empty()) return false;
  for (const int32_t f : own_ids_) {
    const Face& face = faces_.emplace_back(FaceNow(f));
    double longest = 0;
    for (int j = 0; j < face.count; ++j) {
      box.Extend(face.corner[j]);
      longest = std::max(longest, Norm(face.corner[(j + 1) % face.count] - face.corner[j]));
    }
    own_divisions_.push_back(FaceDivisions(longest));
  }
  const Vec3d middle = (box.low + box.high) / 2.0;
  const double reach = Norm(box.high - middle) + kSamplesBeyondFaces;
  sampling_.face_index().VisitNear(middle, reach + kFaceReach, [&](int32_t f) {
    if (!std::binary_search(own_ids_.begin(), own_ids_.end(), f)) faces_.push_back(FaceNow(f));
  });
  CollectBalls();
  return FindSamples(middle, reach);
}

std::vector<int32_t> JointGaps::Seen() const {
  std::vector<int32_t> seen;
  for (const Face& face : faces_) {
    seen.insert(seen.end(), face.vertex.begin(), face.vertex.begin() + face.count);
  }
  SortUnique(seen);
  return seen;
}

void JointGaps::CollectBalls() {
  const size_t blocks = (faces_.size() + kHalfLanes - 1) / kHalfLanes;
  for (std::vector<double>& middles : middles_) middles.assign(blocks * kHalfLanes, kNowhere);
  extents_.assign(blocks * kHalfLanes, 0);
  for (size_t f = 0; f < faces_.size(); ++f) NoteBall(f);
}

void JointGaps::NoteBall(size_t f) {
  for (int a = 0; a < 3; ++a) middles_[a][f] = faces_[f].middle[a];
  extents_[f] = faces_[f].extent;
}

bool JointGaps::FindSamples(const Vec3d& middle, double reach) {
  const auto is_near = [&](const Vec3d& p) {
    return std::any_of(faces_.begin(), faces_.begin() + static_cast<int64_t>(own_ids_.size()),
                       [&](const Face& face) {
                         const double far = face.extent + kSamplesBeyondFaces;
                         return SquaredNorm(p - face.middle) <= far * far;
                       });
  };
  bool is_lost = false;
  sampling_.point_index().VisitNear(middle, reach, [&](int32_t i) {
    const Vec3d& p = sampling_.points()[i];
    if (!is_near(p) || !sampling_.hull().queries->IsWithin(p, kMostOffHull * limits_.free)) return;
    const FacePoint nearest = NearestOnFaces(p, FaceNearMiddle(p), limits_.limit);
    is_lost = is_lost || nearest.distance > kLostDistance;
    samples_.push_back({p, nearest.face});
  });
  sampling_.crease_index().VisitNear(middle, reach, [&](int32_t i) {
    const Vec3d& p = sampling_.crease_points()[i];
    if (is_near(p) && NearestOnEdges(p, kLostDistance).distance < kLostDistance)
      crease_samples_.push_back(p);
  });
  return !is_lost;
}

AMHEX_LANES_INLINE HalfLanes JointGaps::SquaredFromMiddles(const Vec3d& p, size_t block) const {
  const VectorsOf<kHalfLanes> middles = {LanesAt(middles_[0], block), LanesAt(middles_[1], block),
                                         LanesAt(middles_[2], block)};
  const VectorsOf<kHalfLanes> away = middles.From(p);
  return away.Dot(away);
}

// The first of the nearest ones.
size_t JointGaps::FaceNearMiddle(const Vec3d& p) const {
  HalfLanes least = HalfLanes{} + kNowhere * kNowhere;
  HalfMask block_of_least = {};
  RunWithWidestVectors([&] {
    for (size_t block = 0; block < middles_[0].size() / kHalfLanes; ++block) {
      const HalfLanes squared = SquaredFromMiddles(p, block);
      const HalfMask is_nearer = squared < least;
      least = is_nearer ? squared : least;
      block_of_least = is_nearer ? HalfMask{} + static_cast<int64_t>(block) : block_of_least;
    }
  });
  const auto face_of = [&](int lane) { return block_of_least[lane] * kHalfLanes + lane; };
  int best = 0;
  for (int lane = 1; lane < kHalfLanes; ++lane) {
    const bool is_first = least[lane] == least[best] && face_of(lane) < face_of(best);
    if (least[lane] < least[best] || is_first) best = lane;
  }
  return static_cast<size_t>(face_of(best));
}

// Not the nearest where one is found within `enough`.
JointGaps::FacePoint JointGaps::NearestOnFaces(const Vec3d& p, size_t likely, double enough) const {
  FacePoint nearest;
  RunWithWidestVectors([&] {
    double bound = 1e300;  // squared
    const auto look_at = [&](size_t f) {
      const NearestOnFace at = faces_[f].lanes.Nearest(p);
      if (!(at.squared < bound)) return;
      bound = at.squared, nearest.distance = std::sqrt(bound);
      nearest.point = at.point, nearest.face = f, nearest.side = at.side;
    };
    look_at(likely);
    const size_t blocks = extents_.size() / kHalfLanes;
    for (size_t block = 0; block < blocks && bound > enough * enough; ++block) {
      const HalfLanes squared = SquaredFromMiddles(p, block);
      const HalfLanes far = LanesAt(extents_, block) + nearest.distance;
      const HalfMask is_near = squared < far * far;
      for (uint32_t left = BitsOf(is_near); left != 0; left &= left - 1) {
        const int lane = LowestBit(left);
        const size_t f = block * kHalfLanes + static_cast<size_t>(lane);
        const double far_now = extents_[f] + nearest.distance;
        if (f == likely || squared[lane] >= far_now * far_now) continue;
        look_at(f);
        if (bound <= enough * enough) break;
      }
    }
  });
  return nearest;
}

JointGaps::EdgePoint JointGaps::NearestOnEdges(const Vec3d& p, double enough) const {
  EdgePoint nearest;
  for (const Face& face : faces_) {
    if (nearest.distance <= enough) break;
    const double far = face.extent + nearest.distance;
    if (SquaredNorm(p - face.middle) >= far * far) continue;
    for (int j = 0; j < face.count; ++j) {
      const int next = (j + 1) % face.count;
      const Vec3d &a = face.corner[j], &b = face.corner[next];
      const Vec3d q = ClosestPointOnSegment(p, a, b);
      const double distance = Norm(q - p);
      if (!(distance < nearest.distance)) continue;
      const double length = Norm(b - a);
      nearest = {distance,
                 q,
                 {face.vertex[j], face.vertex[next]},
                 length > 0 ? Norm(q - a) / length : 0.0};
    }
  }
  return nearest;
}

JointGaps::Mean JointGaps::MeanAt(const FacePoint& at) const {
  const Face& face = faces_[at.face];
  const int next = (at.side + 1) % face.count;
  const bool is_whole = face.count == 3;
  const std::array<double, 3> weight = WeightsAt(at.point, face.corner[at.side], face.corner[next],
                                                 is_whole ? face.corner[2] : face.middle);
  Mean mean{at.point, face.vertex, {}};
  mean.weight[at.side] += weight[0];
  mean.weight[next] += weight[1];
  if (is_whole) {
    mean.weight[2] += weight[2];
  } else {
    for (double& share : mean.weight) share += weight[2] / 4;
  }
  return mean;
}

template <class Visit>
void JointGaps::VisitClosely(const Visit& visit) const {
  for (size_t i = 0; i < own_ids_.size(); ++i) {
    const Face& face = faces_[i];
    VisitFacePlaces(face.count, own_divisions_[i],
                    [&](const std::array<double, 4>& weight, int side) {
                      if (side >= 0 && face.vertex[side] > face.vertex[(side + 1) % face.count])
                        return;
                      Mean mean{{}, face.vertex, weight};
                      for (int j = 0; j < face.count; ++j) mean.point += face.corner[j] * weight[j];
                      visit(mean);
                    });
  }
}

// Middles of own faces and their edges, and what is halfway to their corners; or more of them.
template <class Visit>
void JointGaps::VisitOwnBoundary(const Visit& visit) const {
  if (detail_ == FaceDetail::kClosely) return VisitClosely(visit);
  for (size_t i = 0; i < own_ids_.size(); ++i) {
    const Face& face = faces_[i];
    Mean middle{face.middle, face.vertex, {}};
    for (int j = 0; j < face.count; ++j) middle.weight[j] = 1.0 / face.count;
    visit(middle);
    for (int j = 0; j < face.count; ++j) {
      const int next = (j + 1) % face.count;
      Mean halfway = middle;
      halfway.point = (middle.point + face.corner[j]) / 2.0;
      for (double& weight : halfway.weight) weight /= 2;
      halfway.weight[j] += 0.5;
      visit(halfway);
      if (face.vertex[j] > face.vertex[next]) continue;  // the next face's
      visit(Mean{(face.corner[j] + face.corner[next]) / 2.0,
                 {face.vertex[j], face.vertex[next], -1, -1},
                 {0.5, 0.5, 0, 0}});
    }
  }
}

double JointGaps::AimFor(Kind kind) const {
  if (kind == Kind::kVertex) return limits_.free;
  return kAim * (kind == Kind::kCrease ? limits_.creases : limits_.limit);
}

template <class Visit>
void JointGaps::VisitDistances(double share, const Visit& visit) {
  Renew();
  const double near_face = share * AimFor(Kind::kSurface);
  for (Sample& sample : samples_) {
    const FacePoint nearest = NearestOnFaces(sample.point, sample.likely, near_face);
    sample.likely = nearest.face;
    if (nearest.distance <= near_face) continue;
    visit(Kind::kSurface, nearest.distance, sample.point, [&] { return MeanAt(nearest); });
  }
  const HullQueries& hull = *sampling_.hull().queries;
  size_t place = 0;
  const auto look_at = [&](Kind kind, const Mean& mean) {
    if (place == likely_.size()) likely_.push_back(place > 0 ? likely_[place - 1] : -1);
    int32_t& likely = likely_[place++];
    if (hull.IsWithin(mean.point, share * AimFor(kind), likely)) return;
    const HullPoint nearest = hull.Closest(mean.point, likely);
    visit(kind, nearest.distance, nearest.point, [&] { return mean; });
  };
  VisitOwnBoundary([&](const Mean& mean) { look_at(Kind::kSurface, mean); });
  for (const int32_t v : moving_) {
    look_at(Kind::kVertex, {placement_.complex.vertices[v], {v, -1, -1, -1}, {1, 0, 0, 0}});
  }
  const double near_edge = share * AimFor(Kind::kCrease);
  for (const Vec3d& p : crease_samples_) {
    const EdgePoint nearest = NearestOnEdges(p, near_edge);
    if (nearest.distance <= near_edge) continue;
    visit(Kind::kCrease, nearest.distance, p, [&] {
      return Mean{nearest.point,
                  {nearest.vertex[0], nearest.vertex[1], -1, -1},
                  {1 - nearest.second_share, nearest.second_share, 0, 0}};
    });
  }
}

JointDeviation JointGaps::Judge() {
  JointDeviation result;
  VisitDistances(1, [&](Kind kind, double distance, const Vec3d&, const auto&) {
    const double excess = std::max(0.0, distance - AimFor(kind));
    const bool is_of_crease = kind == Kind::kCrease;
    (is_of_crease ? result.cost_of_creases : result.cost) += excess * excess;
    double& largest = is_of_crease ? result.largest_of_creases : result.largest;
    largest = std::max(largest, distance);
  });
  return result;
}

std::vector<VertexRow> JointGaps::Rows(double far_weight) {
  std::vector<VertexRow> rows;
  VisitDistances(kSeenShare,
                 [&](Kind kind, double distance, const Vec3d& of_hull, const auto& mean_of) {
                   if (!(distance > 0)) return;
                   const Mean mean = mean_of();
                   const Vec3d towards = (of_hull - mean.point) / distance;
                   VertexRow& row = rows.emplace_back();
                   const bool is_far = kind != Kind::kCrease && distance > limits_.limit;
                   const double weight = is_far ? far_weight : 1.0;
                   row.lack = (distance - AimFor(kind)) * weight;
                   for (size_t j = 0; j < mean.vertex.size(); ++j) {
                     if (mean.weight[j] != 0)
                       row.slopes.push_back({mean.vertex[j], towards * (mean.weight[j] * weight)});
                   }
                 });
  return rows;
}

}  // namespace amhex
