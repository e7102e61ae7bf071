#include "optimize/draw_place.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace amhex {
namespace {

constexpr int kMostSteps = 24;
constexpr int kParts = 3;                 // a step, half of it, a quarter
constexpr double kLeastLaterGain = 1e-2;  // a step that gains a smaller share is the last
// The first one gains most: of 325 tries in which it gained a smaller share, one was worth its
// cost.
constexpr double kLeastFirstGain = 2e-2;
// As where cells are raised (raise_jointly).
constexpr double kFirstDamping = 0.03;
constexpr double kLeastDamping = 1e-5;
constexpr double kMostDamping = 100;
constexpr double kEasier = 0.3;  // after a step that was taken
constexpr double kHarder = 4;    // after one that was refused
// Many distances come down at the cost of the largest. Where it would grow, those beyond the limit
// weigh more, up to this.
constexpr double kMostFarWeight = 64;
// A place this far below its limits is done.
constexpr double kEnough = 0.97;
// A place that keeps more of what it lacked than this has gained nothing.
constexpr double kWorthwhileShare = 0.8;
// What stayed is tried again where it lacks less or more than this share of what it did: of 310
// tries at less, 7 were worth their cost.
constexpr double kOtherShare = 0.1;
// What a place may cost, in units of what cells lack to a scaled Jacobian of 1, besides what coming
// within the limit is worth: for each unit of the squares of distances beyond what is aimed at. A
// crease of an edge length that is followed 0.2 off is 0.05 units of such squares.
constexpr double kWorth = 64;
constexpr double kWorthOfCreases = 16;

// The vertices of one place on their way.
class Attempt {
 public:
  Attempt(const DeviationLimits& limits, double floor, JointPlace& place, JointGaps& around)
      : limits_(limits),
        floor_(floor),
        place_(place),
        around_(around),
        before_(place.Positions()),
        lack_before_(place.LackOfCells()),
        start_(around.Judge()),
        now_(start_) {}

  const JointDeviation& start() const { return start_; }
  bool IsNeeded() const { return !IsWithin(start_, 1); }

  void Run(const RunContext& run) {
    cells_ = place_.Judge(floor_);
    HingeFit fit = FitHere();
    double damping = kFirstDamping;
    for (int step = 0; step < kMostSteps && damping < kMostDamping; ++step) {
      if (IsWithin(now_, kEnough) || run.ShouldStop()) break;
      const JointDeviation from = now_;
      const Outcome outcome = Take(fit.Solve(damping));
      if (outcome == Outcome::kTaken) {
        NoteIfBest();
        const double least_gain =
            from.total() == start_.total() ? kLeastFirstGain : kLeastLaterGain;
        if (now_.total() > (1 - least_gain) * from.total() &&
            now_.largest > (1 - least_gain) * from.largest) {
          break;
        }
        damping = std::max(kLeastDamping, damping * kEasier);
      } else if (!WeighOtherwise(outcome)) {
        damping *= kHarder;
        continue;
      }
      fit = FitHere();
    }
  }

  // Goes where most was gained for what it cost on the way; false if nothing was worth its cost.
  bool TakeBest() {
    if (best_.has_value()) place_.MoveBack(*best_);
    return best_.has_value();
  }
  void TakeBack() { place_.MoveBack(before_); }

 private:
  enum class Outcome : uint8_t { kTaken, kNoGain, kFarther, kBreaks };

  HingeFit FitHere() { return place_.FitHere(cells_, floor_, around_.Rows(far_weight_)); }

  // So that the next fit of here does not end like that; false if nothing more can be done.
  bool WeighOtherwise(Outcome outcome) {
    if (outcome == Outcome::kBreaks) return place_.GuardMoreFirmly();
    if (outcome != Outcome::kFarther || far_weight_ >= kMostFarWeight) return false;
    far_weight_ *= kHarder;
    return true;
  }

  void NoteIfBest() {
    const bool is_mended = start_.largest > limits_.mended && now_.largest <= limits_.mended;
    if (!is_mended && now_.total() > kWorthwhileShare * start_.total()) return;
    const double worth = (is_mended ? limits_.worth : 0) + kWorth * (start_.cost - now_.cost) +
                         kWorthOfCreases * (start_.cost_of_creases - now_.cost_of_creases);
    const double gain = worth - (place_.LackOfCells() - lack_before_);
    // Near enough is what is wanted; what else would gain more is not.
    if (is_best_mended_ && !is_mended) return;
    if (gain < (is_mended == is_best_mended_ ? best_gain_ : 0)) return;
    best_gain_ = gain;
    is_best_mended_ = is_mended;
    best_ = place_.Positions();
  }

  // What a step breaks grows with the square of its length, mostly: if it breaks anything, a part
  // of it may not.
  Outcome Take(std::vector<Vec3d> moves) {
    const std::vector<Vec3d> from = place_.Positions();
    for (int part = 0; part < kParts; ++part) {
      place_.Move(moves);
      PlaceJudgement cells = place_.Judge(floor_);
      if (place_.IsPermitted(cells)) {
        const JointDeviation then = around_.Judge();
        if (IsGain(then)) {
          now_ = then;
          cells_ = std::move(cells);
          return Outcome::kTaken;
        }
        place_.MoveBack(from);
        return then.largest > MostAllowed() ? Outcome::kFarther : Outcome::kNoGain;
      }
      place_.MoveBack(from);
      for (Vec3d& move : moves) move *= 0.5;
    }
    return Outcome::kBreaks;
  }
  bool IsWithin(const JointDeviation& deviation, double share) const {
    return deviation.largest <= share * limits_.limit &&
           deviation.largest_of_creases <= share * limits_.creases;
  }
  bool IsGain(const JointDeviation& then) const {
    return then.total() < now_.total() && then.largest <= MostAllowed();
  }
  double MostAllowed() const { return std::max(start_.largest, limits_.limit); }

  const DeviationLimits& limits_;
  const double floor_;
  JointPlace& place_;
  JointGaps& around_;
  const std::vector<Vec3d> before_;
  const double lack_before_;
  const JointDeviation start_;
  JointDeviation now_;
  PlaceJudgement cells_;  // now
  std::optional<std::vector<Vec3d>> best_;
  double best_gain_ = 0;
  bool is_best_mended_ = false;
  double far_weight_ = 1;
};

}  // namespace

PlaceDraw::PlaceDraw(Placement& placement, const HullSampling& sampling,
                     const DeviationLimits& limits, double floor, FaceDetail detail)
    : limits_(limits),
      floor_(floor),
      place_(placement),
      around_(sampling, placement, limits, detail) {}

DrawnPlace PlaceDraw::Find(int32_t cell, double known_lack, const RunContext& run) {
  place_.EnterLoosely({cell}, floor_);
  DrawnPlace drawn;
  if (around_.Enter(place_.moving())) drawn = Try(known_lack, run);
  drawn.seen = place_.Seen();
  const std::vector<int32_t> others = around_.Seen();
  drawn.seen.insert(drawn.seen.end(), others.begin(), others.end());
  place_.Leave();
  return drawn;
}

DrawnPlace PlaceDraw::Try(double known_lack, const RunContext& run) {
  Attempt attempt(limits_, floor_, place_, around_);
  DrawnPlace drawn;
  drawn.lacked = attempt.start().total();
  const bool is_known = std::abs(known_lack - drawn.lacked) <= kOtherShare * known_lack;
  if (!attempt.IsNeeded() || is_known) return drawn;
  attempt.Run(run);
  drawn.outcome = DrawnPlace::Outcome::kStayed;
  if (attempt.TakeBest()) {
    drawn.outcome = DrawnPlace::Outcome::kMoved;
    drawn.moving = place_.moving();
    drawn.places = place_.Positions();
  }
  attempt.TakeBack();
  return drawn;
}

}  // namespace amhex
