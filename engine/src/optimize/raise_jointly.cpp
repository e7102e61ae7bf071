#include "optimize/raise_jointly.h"

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "optimize/hinge_fit.h"
#include "optimize/joint_place.h"

namespace amhex {
namespace {

// Of larger places the worst cells alone: 52 was the most in ten meshes.
constexpr size_t kMostPoor = 64;
// The poorest corners are raised by so much at a time, so that none falls for the sake of others.
constexpr double kLevelHeight = 0.05;
constexpr int kMostLevels = 12;
constexpr double kLevelGain = 0.004;  // a level that gains less is the last
constexpr double kReached = 0.002;    // a level this near to its aim is done
constexpr int kMostSteps = 12;        // of a level
constexpr double kLeastJointGain =
    1e-3;  // a step that gains a smaller share of the sum is the last
// The damping is in units of a squared slope: a corner's scaled Jacobian changes by about 1 per
// edge length.
constexpr double kFirstDamping = 0.03;
constexpr double kLeastDamping = 1e-5;
constexpr double kMostDamping = 100;
constexpr double kEasier = 0.3;  // after a step that was taken
constexpr double kHarder = 4;    // after one that was refused

// Steps until no corner lacks anything to the aim or nothing is gained. The least scaled Jacobian
// then.
double RaiseTo(double aim, const RunContext& run, JointPlace* place) {
  PlaceJudgement now = place->Judge(aim);
  if (!place->MayMove()) return now.least;
  HingeFit fit = place->FitHere(now, aim);
  double damping = kFirstDamping;
  for (int step = 0; step < kMostSteps && damping < kMostDamping; ++step) {
    if (now.least >= aim - kReached || run.ShouldStop()) break;
    const std::vector<Vec3d> before = place->Positions();
    place->Move(fit.Solve(damping));
    PlaceJudgement then = place->Judge(aim);
    if (!place->IsPermittedGain(now, then)) {
      const bool is_broken = !place->IsPermitted(then);
      place->MoveBack(before);
      if (is_broken && place->GuardMoreFirmly()) {
        fit = place->FitHere(now, aim);
      } else {
        damping *= kHarder;
      }
      continue;
    }
    const bool is_last = then.lack > (1 - kLeastJointGain) * now.lack;
    now = std::move(then);
    if (is_last) break;
    damping = std::max(kLeastDamping, damping * kEasier);
    fit = place->FitHere(now, aim);
  }
  return now.least;
}

void RaisePlace(double wanted, const RunContext& run, JointPlace* place) {
  double least = place->Judge(wanted).least;
  for (int level = 0; level < kMostLevels && least < wanted; ++level) {
    const double reached = RaiseTo(std::min(wanted, least + kLevelHeight), run, place);
    if (reached < least + kLevelGain) break;
    least = reached;
  }
  // Where the worst are stuck, others may not be.
  if (least < wanted) RaiseTo(wanted, run, place);
}

// Poor cells that share vertices, those with the worst first.
std::vector<std::vector<int32_t>> PoorPlaces(const PlacementView& view, double wanted) {
  std::vector<std::vector<int32_t>> places;
  std::vector<uint8_t> is_taken(static_cast<size_t>(view.cells.size), 0);
  const auto quality = [&](int32_t c) { return view.min_scaled_jacobian[c]; };
  const auto take = [&](int32_t c, std::vector<int32_t>* place) {
    if (is_taken[c] != 0 || !(quality(c) < wanted)) return;
    is_taken[c] = 1;
    place->push_back(c);
  };
  for (int32_t seed = 0; seed < view.cells.size; ++seed) {
    std::vector<int32_t> place;
    take(seed, &place);
    for (size_t i = 0; i < place.size(); ++i) {
      for (const int32_t v : view.cells[place[i]]) {
        const ArrayView<const int32_t> cells = view.cells_at[v];
        for (int64_t k = 0; k < cells.size; ++k) take(cells[k], &place);
      }
    }
    if (place.empty()) continue;
    std::sort(place.begin(), place.end(), [&](int32_t a, int32_t b) {
      return quality(a) != quality(b) ? quality(a) < quality(b) : a < b;
    });
    if (place.size() > kMostPoor) place.resize(kMostPoor);
    places.push_back(std::move(place));
  }
  std::stable_sort(places.begin(), places.end(), [&](const auto& a, const auto& b) {
    return quality(a.front()) < quality(b.front());
  });
  return places;
}

// Groups of places, so that none of a group moves what another of it looks at, and of two that do
// the first is in an earlier group: all of a group at once come to what they come to in turn.
std::vector<std::vector<size_t>> IndependentPlaces(const std::vector<std::vector<int32_t>>& places,
                                                   int64_t vertex_count, JointPlace& place) {
  std::vector<std::vector<size_t>> groups;
  // [vertex] groups up to the last one that moves it, and that looks at it
  std::vector<size_t> moved_until(static_cast<size_t>(vertex_count), 0);
  std::vector<size_t> seen_until = moved_until;
  for (size_t i = 0; i < places.size(); ++i) {
    const JointPlace::Extent extent = place.ExtentOf(places[i]);
    size_t group = 0;
    for (const int32_t v : extent.seen) group = std::max(group, moved_until[v]);
    for (const int32_t v : extent.moving) group = std::max(group, seen_until[v]);
    if (group == groups.size()) groups.emplace_back();
    groups[group].push_back(i);
    for (const int32_t v : extent.moving) moved_until[v] = group + 1;
    for (const int32_t v : extent.seen) seen_until[v] = std::max(seen_until[v], group + 1);
  }
  return groups;
}

}  // namespace

void RaiseJointly(Placement& placement, double wanted, const RunContext& run) {
  const std::vector<std::vector<int32_t>> places = PoorPlaces(ViewOf(placement), wanted);
  if (places.empty()) return;
  JointPlace first(placement);
  const auto groups =
      IndependentPlaces(places, static_cast<int64_t>(placement.complex.vertices.size()), first);
  oneapi::tbb::enumerable_thread_specific<JointPlace> own(first);
  for (const std::vector<size_t>& group : groups) {
    oneapi::tbb::parallel_for(size_t{0}, group.size(), [&](size_t i) {
      if (run.ShouldStop()) return;
      JointPlace& place = own.local();
      place.Enter(places[group[i]]);
      RaisePlace(wanted, run, &place);
      place.Leave();
    });
  }
}

}  // namespace amhex
