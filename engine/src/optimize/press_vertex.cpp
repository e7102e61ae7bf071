#include "optimize/press_vertex.h"

#include <algorithm>

#include "base/sort_unique.h"
#include "optimize/lane_cells.h"
#include "optimize/move_judge.h"
#include "optimize/raise_average.h"
#include "optimize/survey_cell.h"

namespace amhex {
namespace {

// Sweeps over the few vertices that give way: first they raise the worst cells over the floor, with
// a penalty as steep as where all the mesh's are raised (place_vertices), then the average.
// A Newton step of an exponential is one part in its steepness: from folding to the floor takes
// many.
constexpr int kRaisingSweeps = 40;
constexpr int kAveragingSweeps = 5;
constexpr double kTarget = 0.5;  // only cells below this are raised, above the floor
constexpr CornerPenalty kRaisingPenalty = {.knee = 0.36, .steepness = 60};
// The faces at the vertex may turn this far from the hull (cosine), as in any move (move_judge).
constexpr double kMinNormalAgreement = 0.3;

}  // namespace

VertexPress::VertexPress(Placement& placement, double floor)
    : placement_(placement),
      view_(ViewOf(placement)),
      floor_(floor),
      active_(placement.complex.vertices.size(), 1),
      moved_(placement.complex.vertices.size(), 0),
      step_(placement.complex.vertices.size(), kFirstSweepStep),
      is_touched_(placement.complex.cells.size(), 0) {}

bool VertexPress::Run(int32_t vertex, const Vec3d& place, double most_loss,
                      const std::function<bool()>& accepts) {
  std::vector<Vec3d>& vertices = placement_.complex.vertices;
  const Vec3d start = vertices[vertex];
  const double agreement = WorstNormalAgreement(view_, vertex, place);
  if (agreement < kMinNormalAgreement && agreement < WorstNormalAgreement(view_, vertex, start)) {
    return false;
  }
  CollectAround(vertex);
  Survey();
  KeepState();
  const Bounds bounds{std::min(floor_, Least()), Lack() + most_loss};
  vertices[vertex] = place;
  SurveyAt(vertex);
  if (Settle(bounds) && accepts()) return true;
  vertices[vertex] = start;
  TakeBack();
  return false;
}

void VertexPress::KeepState() {
  before_.clear();
  for (const int32_t v : inner_) before_.push_back(placement_.complex.vertices[v]);
  survey_before_.clear();
  for (const int32_t c : cells_) {
    survey_before_.push_back({view_.min_scaled_jacobian[c], view_.near_folding[c]});
  }
}

void VertexPress::TakeBack() {
  for (size_t i = 0; i < inner_.size(); ++i) placement_.complex.vertices[inner_[i]] = before_[i];
  for (size_t i = 0; i < cells_.size(); ++i) {
    view_.min_scaled_jacobian[cells_[i]] = survey_before_[i].min_scaled_jacobian;
    view_.near_folding[cells_[i]] = survey_before_[i].near_folding;
  }
}

const std::vector<int32_t>& VertexPress::CellsAround(int32_t vertex) {
  CollectAround(vertex);
  return cells_;
}

// Moves the vertices inside; whether the bounds are kept then.
bool VertexPress::Settle(const Bounds& bounds) {
  Sweep({QualityAim::kMinimum, kTarget, floor_, kRaisingPenalty}, kRaisingSweeps);
  if (Least() < bounds.least || !NoneFolds()) return false;
  Sweep({QualityAim::kAverage, kAverageTarget, floor_, kLooseBound}, kAveragingSweeps);
  return Lack() <= bounds.most_lack;
}

// Free vertices of the cells at the vertex, and of the cells at those.
void VertexPress::CollectAround(int32_t vertex) {
  if (vertex == around_) return;
  around_ = vertex;
  const VertexNeighbourhoods& neighbourhoods = placement_.neighbourhoods;
  inner_.clear();
  std::vector<int32_t> ring = {vertex};
  constexpr int kRings = 2;
  for (int i = 0; i < kRings; ++i) {
    std::vector<int32_t> next;
    for (const int32_t v : ring) {
      for (const int32_t c : neighbourhoods.cells[v]) {
        for (const int32_t w : placement_.complex.cells[c]) {
          if (placement_.constraints.vertex[w].kind == Constraint::kFree) next.push_back(w);
        }
      }
    }
    SortUnique(next);
    inner_.insert(inner_.end(), next.begin(), next.end());
    ring = std::move(next);
  }
  SortUnique(inner_);
  cells_.clear();
  const auto add_cells_at = [&](int32_t v) {
    for (const int32_t c : neighbourhoods.cells[v]) cells_.push_back(c);
  };
  add_cells_at(vertex);
  for (const int32_t v : inner_) add_cells_at(v);
  SortUnique(cells_);
}

void VertexPress::Survey() {
  for (const int32_t c : cells_) SurveyCell(view_, c);
}

void VertexPress::SurveyAt(int32_t vertex) {
  for (const int32_t c : placement_.neighbourhoods.cells[vertex]) SurveyCell(view_, c);
}

void VertexPress::Sweep(const SweepRules& rules, int count) {
  const auto vertex_count = static_cast<int64_t>(step_.size());
  const SweepVisits sweep{view_,
                          rules,
                          {active_.data(), vertex_count},
                          {step_.data(), vertex_count},
                          {moved_.data(), vertex_count}};
  for (const int32_t v : inner_) {
    step_[v] = kFirstSweepStep;
    active_[v] = 1;
  }
  for (int i = 0; i < count; ++i) {
    const bool any = VisitEach(sweep);
    SurveyTouched();
    if (!any) break;
  }
}

// Whether any has moved. A vertex that stays, with its step as it was, does so again until
// something around it changes.
bool VertexPress::VisitEach(const SweepVisits& sweep) {
  bool any = false;
  for (const int32_t v : inner_) {
    if (!sweep.Wants(v)) continue;
    const float step = step_[v];
    LocalRoom room(static_cast<size_t>(placement_.neighbourhoods.cells[v].size()));
    sweep.Visit<LaneCells>(v, room.data());
    if (moved_[v] != 0) {
      any = true;
      NoteMove(v);
    } else if (step_[v] == step) {
      active_[v] = 0;
    }
  }
  return any;
}

void VertexPress::NoteMove(int32_t vertex) {
  for (const int32_t c : placement_.neighbourhoods.cells[vertex]) {
    for (const int32_t v : placement_.complex.cells[c]) active_[v] = 1;
    if (is_touched_[c] != 0) continue;
    is_touched_[c] = 1;
    touched_.push_back(c);
  }
}

// What visits see of the survey changes here too.
void VertexPress::SurveyTouched() {
  for (const int32_t c : touched_) {
    SurveyCell(view_, c);
    for (const int32_t v : placement_.complex.cells[c]) active_[v] = 1;
    is_touched_[c] = 0;
  }
  touched_.clear();
}

double VertexPress::Least() const {
  double least = 1;
  for (const int32_t c : cells_) {
    least = std::min<double>(least, placement_.survey.min_scaled_jacobian[c]);
  }
  return least;
}

bool VertexPress::NoneFolds() const {
  return std::all_of(cells_.begin(), cells_.end(), [&](int32_t c) {
    CellPositions positions;
    for (int slot = 0; slot < 8; ++slot) positions[slot] = view_.vertices[view_.cells[c][slot]];
    return FoldMargin(view_.PatternOf(c), positions) > 0;
  });
}

double VertexPress::Lack() const {
  double lack = 0;
  for (const int32_t c : cells_) lack += 1 - placement_.survey.min_scaled_jacobian[c];
  return lack;
}

}  // namespace amhex
