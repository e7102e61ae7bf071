#include "optimize/gap_closer.h"

#include <algorithm>
#include <array>
#include <utility>

#include "input/hull_queries.h"
#include "optimize/constrain.h"
#include "optimize/lane_cells.h"
#include "optimize/move_judge.h"
#include "optimize/survey_cell.h"

namespace amhex {
namespace {

// Vertices around a gap that are tried, in edge lengths from its middle; nearest first.
constexpr double kReach = 1.25;
constexpr size_t kMostVertices = 8;
constexpr int kMostRounds = 3;
// Shares of the way across a gap.
constexpr std::array<double, 3> kShares = {1.0, 0.5, 0.25};
constexpr double kWorthwhileShare = 0.97;  // of the cost
// What a unit of the cost is worth, in units of what cells lack to a scaled Jacobian of 1.
constexpr double kWorth = 8;
// Where no vertex may move, this many around the gap, nearest first, are tried once more with the
// vertices inside giving way, each at so many places.
constexpr size_t kMostPressed = 3;
constexpr size_t kPlacesPressed = 2;
// A move across a gap is at most this long, edge lengths.
constexpr double kLongestWayAcross = 0.7;

}  // namespace

GapCloser::GapCloser(Placement& placement, const HullSampling& sampling,
                     const DeviationLimits& limits, double floor)
    : placement_(placement),
      sampling_(sampling),
      limits_(limits),
      view_(ViewOf(placement)),
      floor_(floor),
      moved_(placement.complex.vertices.size(), 0),
      changed_(moved_.size(), 0),
      refusals_(moved_.size()),
      press_(placement, floor),
      seen_(placement, sampling, record_.seen) {}

GapRecord& GapCloser::Close(const Gap& gap) {
  record_ = {};
  seen_.StartAnew();
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
  return record_;
}

void GapCloser::Repeat(GapRecord& record) {
  for (GapRecord::Step& step : record.steps) {
    Refusal& refusal = refusals_[step.vertex];
    if (step.choices.has_value()) refusal = {*std::move(step.choices), clock_};
    for (const GapRecord::Move& move : step.moves) {
      placement_.complex.vertices[move.vertex] = move.place;
    }
    NoteMoves(step.moves);
    if (step.was_in_vain) refusal.pressed_at = clock_;
  }
}

void GapCloser::TakeFrom(const GapCloser& other, const std::vector<GapRecord::Step>& steps) {
  const auto take = [&](int32_t v) {
    placement_.complex.vertices[v] = other.placement_.complex.vertices[v];
    moved_[v] = other.moved_[v];
    changed_[v] = other.changed_[v];
    refusals_[v] = other.refusals_[v];
  };
  for (const GapRecord::Step& step : steps) {
    take(step.vertex);
    for (const GapRecord::Move& move : step.moves) take(move.vertex);
  }
  clock_ = other.clock_;
}

void GapCloser::TakeAllFrom(const GapCloser& other) {
  moved_ = other.moved_;
  changed_ = other.changed_;
  refusals_ = other.refusals_;
  clock_ = other.clock_;
}

bool GapCloser::HasChanged(const std::vector<int32_t>& vertices, int64_t since) const {
  return std::any_of(vertices.begin(), vertices.end(),
                     [&](int32_t v) { return changed_[v] > since; });
}

// What decides about a vertex: corners of the cells at it and of faces of the boundary that are
// looked at.
void GapCloser::SeeAround(int32_t v) {
  seen_.AddCells(placement_.neighbourhoods.cells[v]);
  const double reach = refusals_[v].choices.reach;
  if (reach >= 0) seen_.AddFacesNear(placement_.complex.vertices[v], reach);
}

std::vector<int32_t> GapCloser::VerticesAround(const Gap& gap) {
  const Vec3d place = (gap.sample + gap.nearest) / 2.0;
  seen_.AddFacesNear(place, kReach + kFaceReach);
  std::vector<std::pair<double, int32_t>> found;
  for (const int32_t v : record_.seen) {
    const double distance = Norm(placement_.complex.vertices[v] - place);
    if (distance <= kReach) found.emplace_back(distance, v);
  }
  std::sort(found.begin(), found.end());
  if (found.size() > kMostVertices) found.resize(kMostVertices);
  std::vector<int32_t> vertices;
  vertices.reserve(found.size());
  for (const auto& [distance, v] : found) vertices.push_back(v);
  return vertices;
}

// A vertex that stayed where it was does so again until something around it has moved: a corner
// of a cell at it or of a face of the boundary that is looked at.
bool GapCloser::StandsRefused(int32_t v) {
  const Refusal& refusal = refusals_[v];
  if (refusal.choices.reach < 0) return false;
  SeeAround(v);
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
bool GapCloser::HasChangedAt(const Cells& cells, int64_t since) const {
  return std::any_of(cells.begin(), cells.end(), [&](int32_t c) {
    const CellCorners& corners = placement_.complex.cells[c];
    return std::any_of(corners.begin(), corners.end(),
                       [&](int32_t v) { return changed_[v] > since; });
  });
}

void GapCloser::Ask(int32_t v) {
  refusals_[v] = {ChoicesFor(v), clock_};
  SeeAround(v);
  record_.steps.push_back({v, refusals_[v].choices, {}});
}

bool GapCloser::MoveVertex(int32_t v) {
  Ask(v);
  const std::optional<Vec3d> best = BestPlace(v, refusals_[v].choices);
  if (!best.has_value()) return false;
  placement_.complex.vertices[v] = *best;
  record_.steps.back().moves = {{v, *best}};
  NoteMoves(record_.steps.back().moves);
  return true;
}

// To the place that closes most, if the vertices inside can make room for it.
bool GapCloser::PressVertex(int32_t v) {
  if (placement_.constraints.vertex[v].kind == Constraint::kFixed) return false;
  Refusal& refusal = refusals_[v];
  if (!StandsRefused(v)) {
    Ask(v);
  } else {
    record_.steps.push_back({v, std::nullopt, {}});
    const std::vector<int32_t>& cells = press_.CellsAround(v);
    seen_.AddCells(cells);
    if (refusal.pressed_at >= 0 && !HasChangedAt(cells, refusal.pressed_at)) return false;
  }
  GapChoices& choices = refusal.choices;
  if (!choices.is_missed) return false;
  seen_.AddCells(press_.CellsAround(v));
  std::stable_sort(choices.places.begin(), choices.places.end(),
                   [](const auto& a, const auto& b) { return a.cost < b.cost; });
  GapRecord::Step& step = record_.steps.back();
  for (size_t i = 0; i < std::min(choices.places.size(), kPlacesPressed); ++i) {
    const GapChoices::Choice& choice = choices.places[i];
    if (!press_.Run(v, choice.place, kWorth * (choices.here.cost - choice.cost))) continue;
    step.moves = {{v, choice.place}};
    for (const int32_t inner : press_.inner()) {
      step.moves.push_back({inner, placement_.complex.vertices[inner]});
    }
    NoteMoves(step.moves);
    return true;
  }
  refusal.pressed_at = clock_;
  step.was_in_vain = true;
  return false;
}

// Of a vertex of the boundary, and of those inside that gave way for it.
void GapCloser::NoteMoves(const std::vector<GapRecord::Move>& moves) {
  if (!moves.empty()) moved_[moves.front().vertex] = 1;
  for (const GapRecord::Move& move : moves) NoteChange(move.vertex);
  if (moves.size() < 2) return;
  for (const GapRecord::Move& move : moves) {
    for (const int32_t c : placement_.neighbourhoods.cells[move.vertex]) SurveyCell(view_, c);
  }
}

bool GapCloser::IsOnFeature(int32_t v) const {
  const VertexConstraint& constraint = placement_.constraints.vertex[v];
  if (constraint.kind != Constraint::kCrease && constraint.kind != Constraint::kCorner) {
    return false;
  }
  const Vec3d& p = placement_.complex.vertices[v];
  return Norm(Constrain(constraint, p, view_.features).point - p) < kOnFeature;
}

GapChoices GapCloser::ChoicesFor(int32_t v) const {
  GapChoices choices;
  const VertexConstraint& constraint = placement_.constraints.vertex[v];
  if (constraint.kind == Constraint::kFixed) return choices;
  const bool is_on_feature = IsOnFeature(v);
  if (is_on_feature && constraint.kind == Constraint::kCorner) return choices;
  const Vec3d start = placement_.complex.vertices[v];
  VertexDeviation deviation(sampling_, placement_, limits_, v);
  choices.reach = deviation.reach();
  choices.here = deviation.At(start);
  const Deviation& here = choices.here;
  if (!(here.cost > 0) || here.largest > kLostDistance) return choices;
  choices.is_missed =
      here.largest > limits_.limit || deviation.worst_of_creases().distance > limits_.creases;
  const double allowed = std::max(here.largest, kWorthLooking * limits_.limit);
  for (Vec3d place : Candidates(start, deviation)) {
    place = is_on_feature ? Constrain(constraint, place, view_.features).point
                          : sampling_.hull().queries->Closest(place).point;
    if (Norm(place - start) > kLongestWayAcross) continue;
    const Deviation there = deviation.At(place, here.cost);
    if (there.cost >= kWorthwhileShare * here.cost || there.largest > allowed) continue;
    choices.places.push_back({place, there.cost});
  }
  return choices;
}

std::vector<Vec3d> GapCloser::Candidates(const Vec3d& start,
                                         const VertexDeviation& deviation) const {
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

Vec3d GapCloser::NearestOnCreases(const Vec3d& p) const {
  Vec3d nearest = p;
  double distance = kLongestWayAcross;
  for (int64_t c = 0; c < view_.features.creases.size; ++c) {
    const SegmentPoint hit = view_.features.creases[c].segments.Closest(p, distance);
    if (hit.segment >= 0) nearest = hit.point, distance = hit.distance;
  }
  return nearest;
}

// The permitted one that gains most, if the cells around do not lose more.
std::optional<Vec3d> GapCloser::BestPlace(int32_t v, const GapChoices& choices) {
  if (choices.places.empty()) return std::nullopt;
  LocalRoom room(static_cast<size_t>(placement_.neighbourhoods.cells[v].size()));
  MoveJudge<LaneCells> judge(view_, v, CornerPenalty{.kind = EnergyKind::kMinima}, FoldWatch::kNone,
                             room.data());
  double least = kWorth * choices.here.cost + judge.score().energy;
  std::optional<Vec3d> best;
  for (const GapChoices::Choice& choice : choices.places) {
    const LocalScore score = judge.Try(choice.place);
    const double sum = kWorth * choice.cost + score.energy;
    if (sum >= least || !judge.Permits(score, floor_)) continue;
    least = sum;
    best = choice.place;
  }
  return best;
}

}  // namespace amhex
