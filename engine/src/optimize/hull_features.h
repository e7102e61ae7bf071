// The hull as vertex placement sees it: smooth patches, creases between them, corners.
//
// Sharp edges that cells are not to follow (FollowedEdges) are dropped; the patches on their two
// sides become one.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "amhex/vec3.h"
#include "base/stop_poll.h"
#include "exec/resident_slot.h"
#include "input/acute_tips.h"
#include "input/hull.h"
#include "input/hull_queries.h"
#include "optimize/feature_view.h"
#include "optimize/hull_samples.h"
#include "optimize/segment_queries.h"

namespace amhex {

// A point where creases end together: three or more meet, or two in a sharp bend.
struct HullCorner {
  Vec3d position;
  std::vector<int32_t> patches;  // around it, ascending
};

struct CreasePoint {
  Vec3d point;
  Vec3d direction;  // along the crease, unit
  double distance = 0;
};

class HullFeatures {
 public:
  // O(n log n) in the hull's triangles. Throws RunStopped when `poll` does.
  explicit HullFeatures(const Hull& hull, const StopPoll& poll = {});
  HullFeatures(const HullFeatures&) = delete;
  HullFeatures& operator=(const HullFeatures&) = delete;

  int32_t patch_count() const { return static_cast<int32_t>(patch_queries_.size()); }
  int32_t PatchOf(int32_t triangle) const { return patch_of_triangle_[triangle]; }
  const std::vector<HullCorner>& corners() const { return corners_; }
  const std::vector<AcuteTip>& tips() const { return tips_; }
  // Whether the input's points lie off the hull as noise makes them (hull_samples.h).
  bool points_scatter() const { return points_scatter_; }
  // Where the hull is looked at to tell how far it is from a boundary.
  const HullPoints& points() const { return *points_; }
  // Patches that share a crease with `patch`, ascending.
  const std::vector<int32_t>& AdjacentPatches(int32_t patch) const { return adjacent_[patch]; }

  // All of it where bodies run; must not outlive this.
  const FeatureView& view() const { return view_; }
  // For the device's copies of the hull and of the rest of that view.
  ResidentSlot& resident_hull() const { return hull_->queries->resident(); }
  ResidentSlot& resident() const { return resident_; }

  // Closest point of the whole hull; its `triangle` is an index into the hull's triangles.
  HullPoint Closest(const Vec3d& p) const;
  bool IsWithin(const Vec3d& p, double distance) const;  // of the whole hull
  // Closest point of one patch; `triangle` is meaningless. Faster with a bound, which must not be
  // below the distance that is found.
  HullPoint ClosestOnPatch(int32_t patch, const Vec3d& p, double bound = 1e300) const;
  // Closest point of the creases between two patches (a crease that fades out has the same patch
  // on both sides); nullopt if there is none within `reach`.
  std::optional<CreasePoint> ClosestOnCrease(int32_t patch_a, int32_t patch_b, const Vec3d& p,
                                             double reach) const;

 private:
  void MergePatches(const Hull& hull);
  void BuildPatchQueries(const Hull& hull, const StopPoll& poll);
  void BuildCreases(const Hull& hull);
  void FindCorners(const Hull& hull);
  void MakeView();

  const Hull* hull_;
  std::vector<SharpEdge> edges_;  // FollowedEdges
  std::vector<int32_t> patch_of_triangle_;
  std::vector<std::shared_ptr<const HullQueries>> patch_queries_;  // [patch]
  std::vector<std::vector<int32_t>> adjacent_;
  std::map<std::pair<int32_t, int32_t>, SegmentQueries> creases_;  // by (lower, higher) patch
  std::vector<HullCorner> corners_;
  std::vector<AcuteTip> tips_;
  bool points_scatter_ = false;
  std::optional<HullPoints> points_;
  // For the view.
  std::vector<HullView> patch_views_;
  std::vector<CreaseView> crease_views_;
  std::vector<Vec3d> corner_positions_;
  FeatureView view_;
  mutable ResidentSlot resident_;
};

}  // namespace amhex
