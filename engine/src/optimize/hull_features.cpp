#include "optimize/hull_features.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/array_view_of.h"
#include "input/sharp_features.h"

namespace amhex {
namespace {

// Two creases that meet at a vertex with a bend above 45 degrees make a corner.
constexpr double kCornerBendCosine = 0.7071067811865476;

class IndexSets {
 public:
  explicit IndexSets(size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int32_t Find(int32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void Join(int32_t a, int32_t b) {
    a = Find(a), b = Find(b);
    if (a != b) parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<int32_t> parent_;
};

void InsertSorted(std::vector<int32_t>& set, int32_t value) {
  const auto at = std::lower_bound(set.begin(), set.end(), value);
  if (at == set.end() || *at != value) set.insert(at, value);
}

}  // namespace

HullFeatures::HullFeatures(const Hull& hull, const StopPoll& poll)
    : hull_(&hull), edges_(FollowedEdges(hull)) {
  MergePatches(hull);
  poll.Now();
  BuildPatchQueries(hull, poll);
  BuildCreases(hull);
  poll.Now();
  FindCorners(hull);
  tips_ = AcuteTips(hull, poll);
  points_scatter_ = PointsScatter(hull, poll);
  points_.emplace(hull, points_scatter_, poll);
  MakeView();
}

void HullFeatures::MergePatches(const Hull& hull) {
  int32_t count = 0;
  for (const int32_t patch : hull.patch) count = std::max(count, patch + 1);
  IndexSets sets(count);
  size_t kept = 0;
  for (const SharpEdge& edge : hull.sharp_edges) {
    // edges_ is a subsequence of the hull's sharp edges.
    if (kept < edges_.size() && edges_[kept].vertex_a == edge.vertex_a &&
        edges_[kept].vertex_b == edge.vertex_b) {
      ++kept;
    } else {
      sets.Join(hull.patch[edge.triangle_left], hull.patch[edge.triangle_right]);
    }
  }
  std::vector<int32_t> renumbered(count, -1);
  int32_t merged_count = 0;
  for (int32_t p = 0; p < count; ++p) {
    const int32_t root = sets.Find(p);  // the smallest member, so numbered before its others
    renumbered[p] = root == p ? merged_count++ : renumbered[root];
  }
  patch_of_triangle_.reserve(hull.patch.size());
  for (const int32_t patch : hull.patch) patch_of_triangle_.push_back(renumbered[patch]);
  patch_queries_.resize(merged_count);
  adjacent_.resize(merged_count);
}

void HullFeatures::BuildPatchQueries(const Hull& hull, const StopPoll& poll) {
  std::vector<std::vector<std::array<int32_t, 3>>> triangles(patch_queries_.size());
  for (size_t t = 0; t < hull.triangles.size(); ++t) {
    triangles[patch_of_triangle_[t]].push_back(hull.triangles[t]);
  }
  if (patch_queries_.size() == 1) {
    patch_queries_[0] = hull.queries;
    return;
  }
  tbb::parallel_for(size_t{0}, patch_queries_.size(), [&](size_t p) {
    patch_queries_[p] = std::make_shared<const HullQueries>(hull.vertices, triangles[p], poll);
  });
}

void HullFeatures::BuildCreases(const Hull& hull) {
  std::map<std::pair<int32_t, int32_t>, std::vector<SegmentQueries::Segment>> segments;
  for (const SharpEdge& edge : edges_) {
    const int32_t left = patch_of_triangle_[edge.triangle_left];
    const int32_t right = patch_of_triangle_[edge.triangle_right];
    segments[std::minmax(left, right)].push_back(
        {hull.vertices[edge.vertex_a], hull.vertices[edge.vertex_b]});
    if (left == right) continue;
    InsertSorted(adjacent_[left], right);
    InsertSorted(adjacent_[right], left);
  }
  for (auto& [patches, lines] : segments) creases_.emplace(patches, std::move(lines));
}

void HullFeatures::FindCorners(const Hull& hull) {
  std::vector<std::vector<int32_t>> edges_at(hull.vertices.size());
  for (size_t e = 0; e < edges_.size(); ++e) {
    edges_at[edges_[e].vertex_a].push_back(static_cast<int32_t>(e));
    edges_at[edges_[e].vertex_b].push_back(static_cast<int32_t>(e));
  }
  for (size_t v = 0; v < hull.vertices.size(); ++v) {
    if (edges_at[v].size() < 2) continue;
    std::vector<Vec3d> arms;
    HullCorner corner{hull.vertices[v], {}};
    for (const int32_t e : edges_at[v]) {
      const SharpEdge& edge = edges_[e];
      const int32_t other =
          edge.vertex_a == static_cast<int32_t>(v) ? edge.vertex_b : edge.vertex_a;
      arms.push_back(Normalized(hull.vertices[other] - hull.vertices[v]));
      InsertSorted(corner.patches, patch_of_triangle_[edge.triangle_left]);
      InsertSorted(corner.patches, patch_of_triangle_[edge.triangle_right]);
    }
    if (arms.size() == 2 && -Dot(arms[0], arms[1]) > kCornerBendCosine) continue;
    corners_.push_back(corner);
  }
}

void HullFeatures::MakeView() {
  for (const auto& queries : patch_queries_) patch_views_.push_back(queries->view());
  for (const auto& [patches, segments] : creases_) {
    crease_views_.push_back({patches.first, patches.second, segments.view()});
  }
  for (const HullCorner& corner : corners_) corner_positions_.push_back(corner.position);
  view_ = {hull_->queries->view(), ArrayViewOf(patch_views_), ArrayViewOf(crease_views_),
           ArrayViewOf(corner_positions_)};
}

HullPoint HullFeatures::Closest(const Vec3d& p) const { return hull_->queries->Closest(p); }

bool HullFeatures::IsWithin(const Vec3d& p, double distance) const {
  return hull_->queries->IsWithin(p, distance);
}

HullPoint HullFeatures::ClosestOnPatch(int32_t patch, const Vec3d& p, double bound) const {
  return patch_queries_[patch]->Closest(p, bound);
}

std::optional<CreasePoint> HullFeatures::ClosestOnCrease(int32_t patch_a, int32_t patch_b,
                                                         const Vec3d& p, double reach) const {
  const auto found = creases_.find(std::minmax(patch_a, patch_b));
  if (found == creases_.end()) return std::nullopt;
  const SegmentQueries& crease = found->second;
  const SegmentPoint hit = crease.Closest(p, reach);
  if (hit.segment < 0) return std::nullopt;
  const auto& [a, b] = crease.segment(hit.segment);
  return CreasePoint{hit.point, Normalized(b - a), hit.distance};
}

}  // namespace amhex
