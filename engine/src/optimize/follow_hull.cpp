#include "optimize/follow_hull.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "base/status_macros.h"
#include "closure/boundary_defects.h"
#include "closure/working_mesh.h"
#include "input/hull_queries.h"
#include "optimize/hull_deviation.h"
#include "optimize/move_judge.h"
#include "optimize/placement.h"
#include "optimize/press_vertex.h"
#include "optimize/raise_jointly.h"
#include "optimize/raise_quality.h"

namespace amhex {
namespace {

// Good cells give way down to the minimum, within these bounds, as when the average is raised
// (place_vertices).
constexpr double kLeastFloor = 0.31;
constexpr double kMostFloor = 0.5;
// Moving on the hull costs cells around; sweeps regain what they can. Twice, because the sweeps
// move the boundary too.
constexpr int kPasses = 2;
constexpr int kSweepsPerPass = 10;
constexpr double kAverageTarget = 0.99;
// Gaps this near to one that has had its turn are the same.
constexpr double kSameGap = 0.4;
// Gaps are looked at from this share of the limit on.
constexpr double kWorthLooking = 0.9;
// Vertices around a gap that are tried, in edge lengths from its middle; nearest first.
constexpr double kReach = 1.25;
constexpr size_t kMostVertices = 8;
constexpr int kMostRounds = 3;
// Shares of the way across a gap.
constexpr std::array<double, 3> kShares = {1.0, 0.5, 0.25};
constexpr double kWorthwhileShare = 0.97;  // of the cost
// What a unit of the cost is worth, in units of what cells lack to a scaled Jacobian of 1.
constexpr double kWorth = 8;
constexpr double kOnFeature = 0.02;  // a vertex this near to its crease or corner is on it
// What is farther than this from the boundary is lost: no cell reaches into it, and a vertex drawn
// towards it would only bend those before it.
constexpr double kLost = 1.0;
// Where no vertex may move, this many around the gap, nearest first, are tried once more with the
// vertices inside giving way, each at so many places.
constexpr size_t kMostPressed = 3;
constexpr size_t kPlacesPressed = 2;
// What sweeps move by less leaves answers as they were, edge lengths.
constexpr double kStirred = 0.01;
// A move across a gap is at most this long, edge lengths.
constexpr double kLongestMove = 0.7;

// What raising jointly has gained is spent on the way to the hull, and gained once more.
double FloorFor(double minimum) {
  constexpr double kSlack = 0.02;  // levels overshoot what is wanted
  if (minimum < kJointlyWanted + kSlack) return kLeastFloor;
  return std::min(minimum, kMostFloor);
}

class Follower {
 public:
  Follower(Placement& placement, const HullSampling& sampling, const DeviationLimits& limits)
      : placement_(placement),
        sampling_(sampling),
        limits_(limits),
        view_(ViewOf(placement)),
        floor_(FloorFor(SummarizeQuality(placement.complex).min_scaled_jacobian)),
        moved_(placement.complex.vertices.size(), 0),
        changed_(moved_.size(), 0),
        refusals_(moved_.size()),
        press_(placement, floor_) {}

  absl::Status CloseGaps(const std::vector<Gap>& gaps, const RunContext& run) {
    std::vector<Vec3d> places;
    for (const Gap& gap : gaps) {
      if (absl::Status status = run.CheckStop(); !status.ok()) return status;
      const bool is_known = std::any_of(places.begin(), places.end(), [&](const Vec3d& p) {
        return Norm(p - gap.sample) < kSameGap;
      });
      if (is_known) continue;
      places.push_back(gap.sample);
      CloseGap(gap);
    }
    return absl::OkStatus();
  }

  // Raises the average around what has moved, which stays.
  absl::Status RegainQuality(const RunContext& run) {
    const std::vector<Vec3d> before = placement_.complex.vertices;
    SweepMemory memory = StartSweeps(static_cast<int64_t>(moved_.size()));
    std::fill(memory.active.begin(), memory.active.end(), 0);
    NoteMoves(moved_, placement_, memory, StopPoll(run));
    for (size_t v = 0; v < moved_.size(); ++v) {
      if (moved_[v]) placement_.constraints.vertex[v] = {Constraint::kFixed, -1, -1, -1};
    }
    AMHEX_RETURN_IF_ERROR(RunSweeps(
        placement_,
        {QualityAim::kAverage, kAverageTarget, floor_, CornerPenalty{.kind = EnergyKind::kMinima}},
        kSweepsPerPass, memory, run));
    RaiseJointly(placement_, kJointlyWanted, run);
    AMHEX_RETURN_IF_ERROR(run.CheckStop());
    for (size_t v = 0; v < before.size(); ++v) {
      if (Norm(placement_.complex.vertices[v] - before[v]) > kStirred) {
        NoteChange(static_cast<int32_t>(v));
      }
    }
    return absl::OkStatus();
  }

 private:
  void CloseGap(const Gap& gap) {
    const std::vector<int32_t> around = VerticesAround(gap);
    for (int round = 0; round < kMostRounds; ++round) {
      bool moved = false;
      for (const int32_t v : around) {
        if (!StandsRefused(v) && MoveVertex(v)) moved = true;
      }
      if (!moved) break;
    }
    for (size_t i = 0; i < std::min(around.size(), kMostPressed); ++i) {
      if (PressVertex(around[i])) break;
    }
  }

  void NoteChange(int32_t v) { changed_[v] = ++clock_; }

  // A vertex that stayed where it was does so again until something around it has moved: a corner
  // of a cell at it or of a face of the boundary that is looked at.
  bool StandsRefused(int32_t v) const {
    const Refusal& refusal = refusals_[v];
    if (refusal.choices.reach < 0) return false;
    bool stands = !HasChangedAt(placement_.neighbourhoods.cells[v], refusal.asked_at);
    sampling_.face_index().VisitNear(placement_.complex.vertices[v], refusal.choices.reach,
                                     [&](int32_t f) {
                                       const CellFace& face = placement_.complex.hull_faces[f];
                                       for (int j = 0; j < face.count; ++j) {
                                         stands = stands && changed_[face.v[j]] <= refusal.asked_at;
                                       }
                                     });
    return stands;
  }

  // Whether any corner of the cells has moved since.
  template <class Cells>
  bool HasChangedAt(const Cells& cells, int64_t since) const {
    return std::any_of(cells.begin(), cells.end(), [&](int32_t c) {
      const CellCorners& corners = placement_.complex.cells[c];
      return std::any_of(corners.begin(), corners.end(),
                         [&](int32_t v) { return changed_[v] > since; });
    });
  }

  std::vector<int32_t> VerticesAround(const Gap& gap) const {
    const Vec3d place = (gap.sample + gap.nearest) / 2.0;
    std::vector<std::pair<double, int32_t>> found;
    constexpr double kFaceReach = 1.0;
    sampling_.face_index().VisitNear(place, kReach + kFaceReach, [&](int32_t f) {
      const CellFace& face = placement_.complex.hull_faces[f];
      for (int j = 0; j < face.count; ++j) {
        const double distance = Norm(placement_.complex.vertices[face.v[j]] - place);
        if (distance <= kReach) found.emplace_back(distance, face.v[j]);
      }
    });
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    if (found.size() > kMostVertices) found.resize(kMostVertices);
    std::vector<int32_t> vertices;
    for (const auto& [distance, v] : found) vertices.push_back(v);
    return vertices;
  }

  struct Choice {
    Vec3d place;
    double cost;
  };
  bool IsOnFeature(int32_t v) const {
    const VertexConstraint& constraint = placement_.constraints.vertex[v];
    if (constraint.kind != Constraint::kCrease && constraint.kind != Constraint::kCorner) {
      return false;
    }
    const Vec3d& p = placement_.complex.vertices[v];
    return Norm(Constrain(constraint, p, view_.features).point - p) < kOnFeature;
  }

  // Places across the worst gaps around a vertex that it would be better at; none for one that may
  // not move.
  struct Choices {
    double reach = -1;  // of what was looked at; < 0: nothing was
    Deviation here;
    bool is_missed = false;  // something around is farther off than it may be
    std::vector<Choice> places;
  };
  // That a vertex has found no better place, or none that those inside make room for.
  struct Refusal {
    Choices choices;
    int64_t asked_at = 0;     // by clock_
    int64_t pressed_at = -1;  // the same; < 0: it was not pressed
  };
  Choices ChoicesFor(int32_t v) const {
    Choices choices;
    const VertexConstraint& constraint = placement_.constraints.vertex[v];
    if (constraint.kind == Constraint::kFixed) return choices;
    const bool is_on_feature = IsOnFeature(v);
    if (is_on_feature && constraint.kind == Constraint::kCorner) return choices;
    const Vec3d start = placement_.complex.vertices[v];
    VertexDeviation deviation(sampling_, limits_, v);
    choices.reach = deviation.reach();
    choices.here = deviation.At(start);
    const Deviation& here = choices.here;
    if (!(here.cost > 0) || here.largest > kLost) return choices;
    choices.is_missed =
        here.largest > limits_.limit || deviation.worst_of_creases().distance > limits_.creases;
    const double allowed = std::max(here.largest, kWorthLooking * limits_.limit);
    for (Vec3d place : Candidates(start, deviation)) {
      place = is_on_feature ? Constrain(constraint, place, view_.features).point
                            : sampling_.hull().queries->Closest(place).point;
      if (Norm(place - start) > kLongestMove) continue;
      const Deviation there = deviation.At(place, here.cost);
      if (there.cost >= kWorthwhileShare * here.cost || there.largest > allowed) continue;
      choices.places.push_back({place, there.cost});
    }
    return choices;
  }

  bool MoveVertex(int32_t v) {
    Refusal& refusal = refusals_[v];
    refusal = {ChoicesFor(v), clock_};
    return MoveToBest(v, refusal.choices.here.cost, refusal.choices.places);
  }

  // To the place that closes most, if the vertices inside can make room for it.
  bool PressVertex(int32_t v) {
    if (placement_.constraints.vertex[v].kind == Constraint::kFixed) return false;
    Refusal& refusal = refusals_[v];
    if (!StandsRefused(v)) {
      refusal = {ChoicesFor(v), clock_};
    } else if (refusal.pressed_at >= 0 &&
               !HasChangedAt(press_.CellsAround(v), refusal.pressed_at)) {
      return false;
    }
    Choices& choices = refusal.choices;
    if (!choices.is_missed) return false;
    std::stable_sort(choices.places.begin(), choices.places.end(),
                     [](const Choice& a, const Choice& b) { return a.cost < b.cost; });
    for (size_t i = 0; i < std::min(choices.places.size(), kPlacesPressed); ++i) {
      const Choice& choice = choices.places[i];
      if (!press_.Run(v, choice.place, kWorth * (choices.here.cost - choice.cost))) continue;
      moved_[v] = 1;
      NoteChange(v);
      for (const int32_t inner : press_.inner()) NoteChange(inner);
      return true;
    }
    refusal.pressed_at = clock_;
    return false;
  }

  std::vector<Vec3d> Candidates(const Vec3d& start, const VertexDeviation& deviation) const {
    std::vector<Vec3d> places;
    const auto add_towards = [&](const Vec3d& step) {
      for (const double share : kShares) places.push_back(start + step * share);
    };
    const Gap &hull = deviation.worst_of_hull(), &boundary = deviation.worst_of_boundary();
    if (hull.distance > limits_.free) {
      add_towards(hull.sample - hull.nearest);
      add_towards(hull.sample - start);
    }
    if (boundary.distance > limits_.free) add_towards((boundary.nearest - boundary.sample) * 2.0);
    const Gap& crease = deviation.worst_of_creases();
    if (crease.distance > 0) {
      add_towards(crease.sample - crease.nearest);
      places.push_back(crease.sample);
      places.push_back(NearestOnCreases(start));
    }
    return places;
  }

  Vec3d NearestOnCreases(const Vec3d& p) const {
    Vec3d nearest = p;
    double distance = kLongestMove;
    for (int64_t c = 0; c < view_.features.creases.size; ++c) {
      const SegmentPoint hit = view_.features.creases[c].segments.Closest(p, distance);
      if (hit.segment >= 0) nearest = hit.point, distance = hit.distance;
    }
    return nearest;
  }

  // The permitted one that gains most, if the cells around do not lose more.
  bool MoveToBest(int32_t v, double cost, const std::vector<Choice>& choices) {
    if (choices.empty()) return false;
    LocalRoom room(static_cast<size_t>(placement_.neighbourhoods.cells[v].size()));
    MoveJudge judge(view_, v, CornerPenalty{.kind = EnergyKind::kMinima}, FoldWatch::kNone,
                    room.data());
    double least = kWorth * cost + judge.score().energy;
    std::optional<Vec3d> best;
    for (const Choice& choice : choices) {
      const LocalScore score = judge.Try(choice.place);
      const double sum = kWorth * choice.cost + score.energy;
      if (sum >= least || !judge.Permits(score, floor_)) continue;
      least = sum;
      best = choice.place;
    }
    if (!best.has_value()) return false;
    moved_[v] = 1;
    placement_.complex.vertices[v] = *best;
    NoteChange(v);
    return true;
  }

  Placement& placement_;
  const HullSampling& sampling_;
  const DeviationLimits& limits_;
  const PlacementView view_;
  const double floor_;
  std::vector<uint8_t> moved_;     // [vertex] onto a place that was chosen
  std::vector<int64_t> changed_;   // [vertex] when it last moved, by clock_
  std::vector<Refusal> refusals_;  // [vertex]
  int64_t clock_ = 0;              // moves so far
  VertexPress press_;
};

// Takes moves back until the boundary is an embedding again.
void TakeBackDefects(const Hull& hull, const std::vector<Vec3d>& before, const StopPoll& poll,
                     CellComplex* complex) {
  constexpr double kNearDefect = 3.0;
  while (complex->vertices != before) {
    const std::vector<int32_t> defects =
        FindBoundaryDefects(WorkingMesh(*complex, poll), hull, poll);
    if (defects.empty()) return;
    bool any = false;
    for (size_t v = 0; v < before.size(); ++v) {
      if (complex->vertices[v] == before[v]) continue;
      const bool is_near = std::any_of(defects.begin(), defects.end(), [&](int32_t defect) {
        return Norm(before[defect] - before[v]) < kNearDefect;
      });
      if (!is_near) continue;
      complex->vertices[v] = before[v];
      any = true;
    }
    if (!any) complex->vertices = before;
  }
}

}  // namespace

absl::StatusOr<CellComplex> FollowHull(CellComplex complex, const Hull& hull,
                                       const HullFeatures& features, const RunContext& run) {
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  if (complex.cells.empty()) return complex;
  const StopPoll poll(run);
  Placement placement = PreparePlacement(complex, features, poll);
  const HullSampling sampling(hull, placement, poll);
  const DeviationLimits limits = LimitsFor(hull);
  const std::vector<Vec3d> before = complex.vertices;
  Follower follower(placement, sampling, limits);
  for (int pass = 0; pass < kPasses; ++pass) {
    std::vector<Gap> gaps = sampling.GapsBeyond(kWorthLooking * limits.limit, poll);
    for (const Gap& gap : sampling.CreaseGapsBeyond(limits.creases, poll)) gaps.push_back(gap);
    if (gaps.empty()) break;
    AMHEX_RETURN_IF_ERROR(follower.CloseGaps(gaps, run));
    AMHEX_RETURN_IF_ERROR(follower.RegainQuality(run));
  }
  TakeBackDefects(hull, before, poll, &complex);
  return complex;
}

}  // namespace amhex
