#include "optimize/placement.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "base/array_view_of.h"
#include "optimize/survey_cell.h"
#include "optimize/sweep_task.h"

namespace amhex {
namespace {

constexpr size_t kCellsPerBlock = 64;

IncidenceView Viewed(const Incidence& incidence) {
  return {ArrayViewOf(incidence.begin), ArrayViewOf(incidence.item)};
}

// No cell twice.
void RenewSurvey(const std::vector<int32_t>& cells, Placement& placement, const StopPoll& poll) {
  const PlacementView view = ViewOf(placement);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, cells.size(), kCellsPerBlock),
                    [&](const tbb::blocked_range<size_t>& range) {
                      for (size_t i = range.begin(); i < range.end(); ++i) {
                        if ((i - range.begin()) % kCellsPerBlock == 0) poll.Now();
                        SurveyCell(view, cells[i]);
                      }
                    });
}

}  // namespace

PlacementView ViewOf(Placement& placement) {
  PlacementView view;
  view.vertices = WritableViewOf(placement.complex.vertices);
  view.cells = ArrayViewOf(placement.complex.cells);
  view.hull_faces = ArrayViewOf(placement.complex.hull_faces);
  view.patterns = ArrayViewOf(AllCellPatterns());
  view.pattern_of_cell = ArrayViewOf(placement.neighbourhoods.patterns);
  view.cells_at = Viewed(placement.neighbourhoods.cells);
  view.hull_faces_at = Viewed(placement.neighbourhoods.hull_faces);
  view.constraints = ArrayViewOf(placement.constraints.vertex);
  view.face_normal = ArrayViewOf(placement.constraints.face_normal);
  view.known_feet = WritableViewOf(placement.known_feet);
  view.likely_triangles = WritableViewOf(placement.likely_triangles);
  view.min_scaled_jacobian = WritableViewOf(placement.survey.min_scaled_jacobian);
  view.near_folding = WritableViewOf(placement.survey.near_folding);
  view.features = placement.features.view();
  return view;
}

ActiveVertices ActiveVertices::None(int64_t count) {
  ActiveVertices none;
  none.is_active_.assign(static_cast<size_t>(count), 0);
  return none;
}

ActiveVertices ActiveVertices::All(int64_t count) {
  ActiveVertices all;
  all.is_active_.assign(static_cast<size_t>(count), 1);
  all.list_.resize(all.is_active_.size());
  std::iota(all.list_.begin(), all.list_.end(), 0);
  return all;
}

void ActiveVertices::Clear() {
  for (const int32_t v : list_) is_active_[v] = 0;
  list_.clear();
  is_sorted_ = true;
}

const std::vector<int32_t>& ActiveVertices::list() {
  // Where most are, finding them all takes less than sorting.
  constexpr size_t kManyShare = 16;
  if (!is_sorted_ && list_.size() > is_active_.size() / kManyShare) ListAnew();
  if (!is_sorted_) std::sort(list_.begin(), list_.end());
  is_sorted_ = true;
  return list_;
}

void ActiveVertices::ListAnew() {
  list_.clear();
  for (size_t v = 0; v < is_active_.size(); ++v) {
    if (is_active_[v] != 0) list_.push_back(static_cast<int32_t>(v));
  }
  is_sorted_ = true;
}

ActiveVertices AllVertices(const Placement& placement) {
  return ActiveVertices::All(static_cast<int64_t>(placement.complex.vertices.size()));
}

SweepMemory StartSweeps(int64_t vertex_count) {
  return {ActiveVertices::All(vertex_count), std::vector<float>(vertex_count, kFirstSweepStep)};
}

SweepTask TaskFor(Placement& placement, SweepMemory& memory, const RunContext& run) {
  SweepTask task;
  task.placement = ViewOf(placement);
  task.resident = {&placement.features.resident_hull(), &placement.features.resident(),
                   &placement.resident};
  task.active = &memory.active.flags();
  task.step = &memory.step;
  for (const std::vector<int32_t>& colour : placement.neighbourhoods.colours) {
    task.colours.push_back(ArrayViewOf(colour));
  }
  task.should_stop = [&run] { return run.ShouldStop(); };
  return task;
}

Placement PreparePlacement(CellComplex& complex, const HullFeatures& features,
                           const StopPoll& poll) {
  VertexNeighbourhoods neighbourhoods = FindNeighbourhoods(complex, poll);
  VertexConstraints constraints = AssignConstraints(complex, neighbourhoods, features, poll);
  constexpr double kAnywhere = std::numeric_limits<double>::infinity();
  Placement placement{complex,
                      features,
                      std::move(neighbourhoods),
                      std::move(constraints),
                      {},
                      std::vector<Vec3d>(complex.vertices.size(), {kAnywhere, 0, 0}),
                      std::vector<int32_t>(complex.hull_faces.size(), -1)};
  SurveyAllCells(placement, poll);
  return placement;
}

void SurveyAllCells(Placement& placement, const StopPoll& poll) {
  std::vector<int32_t> all(placement.complex.cells.size());
  std::iota(all.begin(), all.end(), 0);
  placement.survey.min_scaled_jacobian.resize(all.size());
  placement.survey.near_folding.resize(all.size());
  RenewSurvey(all, placement, poll);
}

std::vector<int32_t> Marked(const std::vector<int32_t>& vertices,
                            const std::vector<uint8_t>& marks) {
  std::vector<int32_t> marked;
  for (const int32_t v : vertices) {
    if (marks[v] != 0) marked.push_back(v);
  }
  return marked;
}

void NoteMoves(const std::vector<int32_t>& moved, Placement& placement, SweepMemory& memory,
               const StopPoll& poll) {
  std::vector<int32_t>& visitor_of_cell = memory.scratch.visitor_of_cell;
  visitor_of_cell.resize(placement.complex.cells.size(), -1);
  std::vector<int32_t> touched;
  for (size_t i = 0; i < moved.size(); ++i) {
    poll.At(static_cast<int64_t>(i));
    for (const int32_t c : placement.neighbourhoods.cells[moved[i]]) {
      if (visitor_of_cell[c] >= 0) continue;
      visitor_of_cell[c] = moved[i];
      touched.push_back(c);
      for (const int32_t neighbour : placement.complex.cells[c]) memory.active.Add(neighbour);
    }
  }
  for (const int32_t c : touched) visitor_of_cell[c] = -1;
  RenewSurvey(touched, placement, poll);
}

}  // namespace amhex
