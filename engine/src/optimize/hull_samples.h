// Where a hull is looked at to tell how far it is from a boundary.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/stop_poll.h"
#include "input/hull.h"
#include "input/hull_queries.h"
#include "optimize/feature_view.h"
#include "optimize/surroundings.h"

namespace amhex {

// Whether the input's points lie off the hull by more than does not count as noise makes them, a
// tenth of them or more. Then the hull tells where the solid is, not they.
bool PointsScatter(const Hull& hull, const StopPoll& poll);

// Points spread evenly over a hull, points of the input where it has some.
class HullPoints {
 public:
  // None off the hull where points scatter. O(n log n); `hull` must outlive this. Throws RunStopped
  // when `poll` does.
  HullPoints(const Hull& hull, bool points_scatter, const StopPoll& poll);

  // Of the input's points near one another the one farthest from `boundary`, and all that are
  // farther than is wanted; of those within the surroundings. O(n log m).
  std::vector<Vec3d> Against(const HullQueries& boundary, const StopPoll& poll,
                             const Surroundings& around = {}) const;

 private:
  std::vector<int32_t> Within(const Surroundings& around) const;
  std::vector<double> DistancesTo(const HullQueries& boundary, const std::vector<int32_t>& of,
                                  const StopPoll& poll) const;
  // Of those that count, number `k`.
  const Vec3d& InputPoint(int32_t k) const {
    return hull_.input_points[static_cast<size_t>(input_points_[static_cast<size_t>(k)])];
  }

  const Hull& hull_;
  std::vector<Vec3d> elsewhere_;       // where the input has no point
  std::vector<int32_t> input_points_;  // those that count, ascending
  std::vector<int32_t> cube_of_;       // [of these] points of one cube are near one another
  size_t cube_count_ = 0;
};

// Spread evenly along the creases, within the surroundings.
std::vector<Vec3d> CreasePoints(const FeatureView& features, const Surroundings& around = {});

}  // namespace amhex
