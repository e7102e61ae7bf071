#include "optimize/placement.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <utility>

namespace amhex {
namespace {

// Vertices between two looks at the stop flag: some milliseconds of work.
constexpr size_t kVerticesPerPoll = 64;
// Hull faces whose corner normals agree less with the hull fold over it: a closed conforming mesh
// can overlap itself there.
constexpr double kMinNormalAgreement = 0.3;
// Hull faces whose middle is nearer to the hull than this many edge lengths may sag freely.
constexpr double kFreeSag = 0.12;
constexpr float kFirstStep = 0.1F;  // edge lengths

}  // namespace

SweepMemory StartSweeps(int64_t vertex_count) {
  return {std::vector<uint8_t>(vertex_count, 1), std::vector<float>(vertex_count, kFirstStep)};
}

Placement PreparePlacement(CellComplex& complex, const HullFeatures& features) {
  VertexNeighbourhoods neighbourhoods = FindNeighbourhoods(complex);
  VertexConstraints constraints = AssignConstraints(complex, neighbourhoods, features);
  CellSurvey survey = SurveyCells(complex, neighbourhoods);
  return {complex, features, std::move(neighbourhoods), std::move(constraints), std::move(survey)};
}

void NoteMoves(const std::vector<uint8_t>& moved, Placement& placement, SweepMemory& memory) {
  std::vector<uint8_t> is_touched(placement.complex.cells.size(), 0);
  std::vector<int32_t> touched;
  for (size_t v = 0; v < moved.size(); ++v) {
    if (!moved[v]) continue;
    for (const int32_t c : placement.neighbourhoods.cells[static_cast<int64_t>(v)]) {
      if (is_touched[c]) continue;
      is_touched[c] = 1;
      touched.push_back(c);
      for (const int32_t neighbour : placement.complex.cells[c]) memory.active[neighbour] = 1;
    }
  }
  RenewSurvey(placement.complex, placement.neighbourhoods, touched, placement.survey);
}

absl::Status VisitByColour(const VertexNeighbourhoods& neighbourhoods, const RunContext& run,
                           const std::function<void(int32_t)>& visit) {
  for (const std::vector<int32_t>& colour : neighbourhoods.colours) {
    std::atomic<bool> stopped{false};
    tbb::parallel_for(tbb::blocked_range<size_t>(0, colour.size(), kVerticesPerPoll),
                      [&](const tbb::blocked_range<size_t>& range) {
                        for (size_t i = range.begin(); i < range.end(); ++i) {
                          if ((i - range.begin()) % kVerticesPerPoll == 0 && run.ShouldStop()) {
                            stopped.store(true, std::memory_order_relaxed);
                            return;
                          }
                          visit(colour[i]);
                        }
                      });
    if (stopped.load()) return run.CheckStop();
  }
  return absl::OkStatus();
}

double WorstNormalAgreement(const Placement& placement, int32_t vertex, const Vec3d& position) {
  const std::vector<Vec3d>& vertices = placement.complex.vertices;
  const auto at = [&](int32_t v) -> const Vec3d& { return v == vertex ? position : vertices[v]; };
  double worst = 1;
  for (const int32_t f : placement.neighbourhoods.hull_faces[vertex]) {
    const CellFace& face = placement.complex.hull_faces[f];
    const int corner_count = face.count == 3 ? 1 : 4;
    for (int j = 0; j < corner_count; ++j) {
      const Vec3d& corner = at(face.v[j]);
      const Vec3d to_next = at(face.v[(j + 1) % face.count]) - corner;
      const Vec3d to_previous = at(face.v[(j + face.count - 1) % face.count]) - corner;
      const Vec3d normal = Normalized(Cross(to_next, to_previous));
      worst = std::min(worst, Dot(normal, placement.constraints.face_normal[f]));
    }
  }
  return worst;
}

namespace {

// The middle of a hull face, were its corner `vertex` at `position`.
Vec3d FaceMiddle(const Placement& placement, int32_t f, int32_t vertex, const Vec3d& position) {
  const CellFace& face = placement.complex.hull_faces[f];
  Vec3d middle;
  for (int j = 0; j < face.count; ++j) {
    middle += face.v[j] == vertex ? position : placement.complex.vertices[face.v[j]];
  }
  return middle / static_cast<double>(face.count);
}

}  // namespace

MoveJudge::MoveJudge(const Placement& placement, int32_t vertex, const CornerPenalty& penalty,
                     const std::vector<uint8_t>& near_folding)
    : placement_(placement),
      vertex_(vertex),
      start_(placement.complex.vertices[vertex]),
      cells_(placement.complex, placement.neighbourhoods, vertex, penalty, near_folding),
      score_(cells_.Score()) {}

LocalScore MoveJudge::Try(const Vec3d& position) {
  cells_.MoveTo(position);
  return cells_.Score();
}

bool MoveJudge::Permits(const LocalScore& trial, double floor) {
  if (!(trial.minimum >= std::min(score_.minimum, floor))) return false;
  const Vec3d tried = cells_.position();
  const double margin = cells_.WorstFoldMargin();
  if (margin <= 0) {
    // Cells that fold already may only unfold.
    cells_.MoveTo(start_);
    const double margin_before = cells_.WorstFoldMargin();
    cells_.MoveTo(tried);
    if (margin <= margin_before) return false;
  }
  if (placement_.constraints.vertex[vertex_].kind == Constraint::kFree) return true;
  const double agreement = WorstNormalAgreement(placement_, vertex_, tried);
  if (agreement < kMinNormalAgreement &&
      agreement < WorstNormalAgreement(placement_, vertex_, start_)) {
    return false;
  }
  return SagIsPermitted(tried);
}

bool MoveJudge::SagIsPermitted(const Vec3d& position) {
  const auto faces = placement_.neighbourhoods.hull_faces[vertex_];
  for (int64_t i = 0; i < faces.size(); ++i) {
    const Vec3d middle = FaceMiddle(placement_, faces.first[i], vertex_, position);
    if (placement_.features.IsWithin(middle, kFreeSag)) continue;
    if (!placement_.features.IsWithin(middle, SagBefore(i))) return false;
  }
  return true;
}

double MoveJudge::SagBefore(int64_t i) {
  const auto faces = placement_.neighbourhoods.hull_faces[vertex_];
  if (sag_before_.empty()) sag_before_.assign(faces.size(), -1.0);
  if (sag_before_[i] < 0) {
    const Vec3d middle = FaceMiddle(placement_, faces.first[i], vertex_, start_);
    sag_before_[i] = placement_.features.Closest(middle).distance;
  }
  return sag_before_[i];
}

}  // namespace amhex
