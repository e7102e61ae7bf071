#include "optimize/draw_jointly.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "input/triangle_math.h"
#include "optimize/joint_gaps.h"
#include "optimize/joint_place.h"

namespace amhex {
namespace {

constexpr int kMostSteps = 12;
constexpr double kLeastGain = 1e-2;  // a step that gains a smaller share is the last
// The first one gains most: of 325 tries in which it gained a smaller share, one was worth its
// cost.
constexpr double kLeastFirstGain = 2e-2;
// As where cells are raised (raise_jointly).
constexpr double kFirstDamping = 0.03;
constexpr double kLeastDamping = 1e-5;
constexpr double kMostDamping = 100;
constexpr double kEasier = 0.3;  // after a step that was taken
constexpr double kHarder = 4;    // after one that was refused
// A place this far below its limits is done.
constexpr double kEnough = 0.97;
// A place that keeps more of what it lacked than this has gained nothing.
constexpr double kWorthwhileShare = 0.8;
// What stayed is tried again where it lacks less or more than this share of what it did: of 310
// tries at less, 7 were worth their cost.
constexpr double kOtherShare = 0.1;
// What a place may cost, in units of what cells lack to a scaled Jacobian of 1: for coming within
// the limit, and for each unit of the squares of distances beyond what is aimed at. A crease of an
// edge length that is followed 0.2 off is 0.05 units of such squares.
constexpr double kWorthOfLimit = 0.5;
constexpr double kWorth = 64;
constexpr double kWorthOfCreases = 16;
// Of more gaps for each face of the boundary than this, points scatter: there are gaps everywhere,
// and following them would follow noise (0.9 for an igea with noise, 0.1 for bunny at 3,400 cells).
constexpr double kMostGapsPerFace = 0.5;
// Places that are tried in one call, for the time's sake: as many as this, and one for so many
// cells.
constexpr int64_t kLeastTries = 96;
constexpr int64_t kCellsPerTry = 50;
constexpr double kFaceReach = 2.0;  // from a gap to the middle of the face that is nearest to it

double DistanceTo(const CellFace& face, const std::vector<Vec3d>& at, const Vec3d& p) {
  const auto to_half = [&](int a, int b, int c) {
    return Norm(ClosestPointOnTriangle(p, at[face.v[a]], at[face.v[b]], at[face.v[c]]) - p);
  };
  return face.count == 3 ? to_half(0, 1, 2) : std::min(to_half(0, 1, 2), to_half(2, 3, 0));
}

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
    PlaceJudgement cells = place_.Judge(floor_);
    HingeFit fit = place_.FitHere(cells, floor_, around_.Rows());
    double damping = kFirstDamping;
    for (int step = 0; step < kMostSteps && damping < kMostDamping; ++step) {
      if (IsWithin(now_, kEnough) || run.ShouldStop()) break;
      const std::vector<Vec3d> from = place_.Positions();
      place_.Move(fit.Solve(damping));
      PlaceJudgement then_cells = place_.Judge(floor_);
      const bool is_permitted = place_.IsPermitted(then_cells);
      const JointDeviation then = is_permitted ? around_.Judge() : now_;
      if (!is_permitted || !IsGain(then)) {
        place_.MoveBack(from);
        damping *= kHarder;
        continue;
      }
      const double least_gain = now_.total() == start_.total() ? kLeastFirstGain : kLeastGain;
      const bool is_last = then.total() > (1 - least_gain) * now_.total();
      now_ = then;
      cells = std::move(then_cells);
      if (is_last) break;
      damping = std::max(kLeastDamping, damping * kEasier);
      fit = place_.FitHere(cells, floor_, around_.Rows());
    }
  }

  bool IsWorthItsCost() const {
    if (now_.total() > kWorthwhileShare * start_.total()) return false;
    const bool is_mended = start_.largest > limits_.limit && now_.largest <= limits_.limit;
    const double worth = (is_mended ? kWorthOfLimit : 0) + kWorth * (start_.cost - now_.cost) +
                         kWorthOfCreases * (start_.cost_of_creases - now_.cost_of_creases);
    return place_.LackOfCells() - lack_before_ <= worth;
  }

  void TakeBack() { place_.MoveBack(before_); }

 private:
  bool IsWithin(const JointDeviation& deviation, double share) const {
    return deviation.largest <= share * limits_.limit &&
           deviation.largest_of_creases <= share * limits_.creases;
  }
  bool IsGain(const JointDeviation& then) const {
    return then.total() < now_.total() && then.largest <= std::max(start_.largest, limits_.limit);
  }

  const DeviationLimits& limits_;
  const double floor_;
  JointPlace& place_;
  JointGaps& around_;
  const std::vector<Vec3d> before_;
  const double lack_before_;
  const JointDeviation start_;
  JointDeviation now_;
};

}  // namespace

JointDraw::JointDraw(Placement& placement, const HullSampling& sampling,
                     const DeviationLimits& limits, double floor)
    : placement_(placement),
      sampling_(sampling),
      limits_(limits),
      floor_(floor),
      moved_(placement.complex.vertices.size(), 0),
      known_(placement.complex.vertices),
      changed_(placement.complex.vertices.size(), 0) {}

bool JointDraw::Run(const std::vector<Gap>& gaps, const RunContext& run) {
  const CellComplex& complex = placement_.complex;
  if (static_cast<double>(gaps.size()) >
      kMostGapsPerFace * static_cast<double>(complex.hull_faces.size())) {
    return false;
  }
  int64_t tries = std::max(kLeastTries, static_cast<int64_t>(complex.cells.size()) / kCellsPerTry);
  JointPlace place(placement_);
  JointGaps around(sampling_, placement_, limits_);
  bool any = false;
  NoteMoves();
  for (const Gap& gap : gaps) {
    if (tries <= 0 || run.ShouldStop()) break;
    const int32_t cell = CellAt(gap);
    if (cell < 0) continue;
    Refusal& refusal = refusals_[cell];
    if (Stands(refusal)) continue;
    place.EnterLoosely({cell}, floor_);
    const Outcome outcome =
        around.Enter(place.moving()) ? DrawPlace(place, around, refusal, run) : Outcome::kNotTried;
    if (outcome != Outcome::kNotTried) --tries;
    if (outcome == Outcome::kMoved) {
      any = true;
      refusals_.erase(cell);
      ++clock_;
      for (const int32_t v : place.moving()) changed_[v] = clock_, moved_[v] = 1;
    } else {
      refusal.asked_at = clock_;
      refusal.seen = place.Seen();
      const std::vector<int32_t> others = around.Seen();
      refusal.seen.insert(refusal.seen.end(), others.begin(), others.end());
    }
    place.Leave();
  }
  known_ = complex.vertices;
  return any;
}

// Those since the last call that others have made.
void JointDraw::NoteMoves() {
  ++clock_;
  for (size_t v = 0; v < known_.size(); ++v) {
    if (known_[v] != placement_.complex.vertices[v]) changed_[v] = clock_;
  }
}

// All that it saw is where it was.
bool JointDraw::Stands(const Refusal& refusal) const {
  return !refusal.seen.empty() &&
         std::all_of(refusal.seen.begin(), refusal.seen.end(),
                     [&](int32_t v) { return changed_[v] <= refusal.asked_at; });
}

JointDraw::Outcome JointDraw::DrawPlace(JointPlace& place, JointGaps& around, Refusal& refusal,
                                        const RunContext& run) {
  Attempt attempt(limits_, floor_, place, around);
  const double lacked = attempt.start().total();
  const bool is_known = std::abs(refusal.lacked - lacked) <= kOtherShare * refusal.lacked;
  if (!attempt.IsNeeded() || is_known) return Outcome::kNotTried;
  attempt.Run(run);
  if (attempt.IsWorthItsCost()) return Outcome::kMoved;
  refusal.lacked = lacked;
  attempt.TakeBack();
  return Outcome::kStayed;
}

// That of the face nearest to the gap; -1 if there is none near.
int32_t JointDraw::CellAt(const Gap& gap) const {
  const CellComplex& complex = placement_.complex;
  const Vec3d place = (gap.sample + gap.nearest) / 2.0;
  int32_t nearest = -1;
  double least = 1e300;
  sampling_.face_index().VisitNear(place, kFaceReach, [&](int32_t f) {
    const double distance = DistanceTo(complex.hull_faces[f], complex.vertices, place);
    if (distance < least) least = distance, nearest = f;
  });
  if (nearest < 0) return -1;
  const CellFace& face = complex.hull_faces[nearest];
  for (const int32_t c : placement_.neighbourhoods.cells[face.v[0]]) {
    const CellCorners& corners = complex.cells[c];
    const auto is_corner = [&](int32_t v) {
      return std::find(corners.begin(), corners.end(), v) != corners.end();
    };
    if (std::all_of(face.v.begin(), face.v.begin() + face.count, is_corner)) return c;
  }
  return -1;
}

}  // namespace amhex
