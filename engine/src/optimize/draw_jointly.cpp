#include "optimize/draw_jointly.h"

#include <oneapi/tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "base/sort_unique.h"
#include "input/triangle_math.h"
#include "optimize/look_ahead.h"
#include "optimize/placement_copy.h"
#include "optimize/placement_view.h"
#include "optimize/survey_cell.h"

namespace amhex {
namespace {

// Of more gaps for each face of the boundary than this, points scatter: there are gaps everywhere,
// and following them would follow noise (0.9 for an igea with noise, 0.1 for bunny at 3,400 cells).
constexpr double kMostGapsPerFace = 0.5;
// Places that are tried in one call, for the time's sake: as many as this, and one for so many
// cells.
constexpr int64_t kLeastTries = 96;
constexpr int64_t kCellsPerTry = 50;
// Places this near to one another may well see each other move, edge lengths.
constexpr double kSeenAround = 7.0;
constexpr double kFaceSearchReach =
    2.0;  // from a gap to the middle of the face that is nearest to it

double FaceDistance(const CellFace& face, const std::vector<Vec3d>& at, const Vec3d& p) {
  const auto to_half = [&](int a, int b, int c) {
    return Norm(ClosestPointOnTriangle(p, at[face.v[a]], at[face.v[b]], at[face.v[c]]) - p);
  };
  return face.count == 3 ? to_half(0, 1, 2) : std::min(to_half(0, 1, 2), to_half(2, 3, 0));
}

void MoveTo(const DrawnPlace& drawn, Placement& placement) {
  const PlacementView view = ViewOf(placement);
  for (size_t i = 0; i < drawn.moving.size(); ++i) {
    view.vertices[drawn.moving[i]] = drawn.places[i];
  }
  std::vector<int32_t> cells;
  for (const int32_t v : drawn.moving) {
    const ArrayView<const int32_t> at = view.cells_at[v];
    cells.insert(cells.end(), at.data, at.data + at.size);
  }
  SortUnique(cells);
  for (const int32_t c : cells) SurveyCell(view, c);
}

}  // namespace

JointDraw::JointDraw(Placement& placement, const HullSampling& sampling,
                     const DeviationLimits& limits, double floor, FaceDetail detail)
    : placement_(placement),
      sampling_(sampling),
      limits_(limits),
      floor_(floor),
      detail_(detail),
      moved_(placement.complex.vertices.size(), 0),
      known_(placement.complex.vertices),
      changed_(placement.complex.vertices.size(), 0) {}

// In the order in which they were made.
using Moves = std::vector<std::shared_ptr<const DrawnPlace>>;

// The placement once more, to find out on what would happen to it.
struct JointDraw::Rehearsal {
  Rehearsal(const Placement& original, const HullSampling& sampling, const DeviationLimits& limits,
            double floor, FaceDetail detail, size_t moves_made)
      : copy(original),
        draw(copy.placement, sampling, limits, floor, detail),
        moves_seen(moves_made) {}

  // Those that it has not seen yet.
  Moves MissedOf(const Moves& moves) {
    const size_t first = std::exchange(moves_seen, moves.size());
    return {moves.begin() + static_cast<int64_t>(first), moves.end()};
  }

  PlacementCopy copy;
  PlaceDraw draw;
  size_t moves_seen;
};

bool JointDraw::Run(const std::vector<Gap>& gaps, const RunContext& run) {
  const CellComplex& complex = placement_.complex;
  if (static_cast<double>(gaps.size()) >
      kMostGapsPerFace * static_cast<double>(complex.hull_faces.size())) {
    return false;
  }
  int64_t tries = std::max(kLeastTries, static_cast<int64_t>(complex.cells.size()) / kCellsPerTry);
  PlaceDraw draw(placement_, sampling_, limits_, floor_, detail_);
  Moves moves;
  oneapi::tbb::enumerable_thread_specific<std::unique_ptr<Rehearsal>> rehearsals;
  NoteMoves();
  const auto look = [&](size_t i) {
    Found found{CellAt(gaps[i]), clock_, {}};
    Rehearsal* rehearsal = nullptr;
    Moves missed;
    if (found.cell >= 0 && !Stands(found.cell)) {
      std::unique_ptr<Rehearsal>& own = rehearsals.local();
      if (own == nullptr) {
        own = std::make_unique<Rehearsal>(placement_, sampling_, limits_, floor_, detail_,
                                          moves.size());
      }
      missed = own->MissedOf(moves);
      rehearsal = own.get();
    }
    const double lacked = RefusalAt(found.cell).lacked;
    return
        [rehearsal, lacked, &run, found = std::move(found), missed = std::move(missed)]() mutable {
          if (rehearsal == nullptr) return std::move(found);
          for (const auto& move : missed) MoveTo(*move, rehearsal->copy.placement);
          found.drawn = rehearsal->draw.Find(found.cell, lacked, run);
          return std::move(found);
        };
  };
  const auto holds = [&](size_t i, const Found& found) {
    const int32_t cell = CellAt(gaps[i]);
    return cell < 0 || Stands(cell) || Holds(found, cell);
  };
  const auto take = [&](size_t i, std::optional<Found> found) {
    if (tries <= 0) return false;
    const int32_t cell = CellAt(gaps[i]);
    if (cell < 0 || Stands(cell)) return true;
    DrawnPlace drawn =
        found.has_value() ? *std::move(found->drawn) : draw.Find(cell, RefusalAt(cell).lacked, run);
    if (drawn.outcome != DrawnPlace::Outcome::kNotTried) --tries;
    if (drawn.outcome == DrawnPlace::Outcome::kMoved) {
      Move(drawn, cell);
      moves.push_back(std::make_shared<const DrawnPlace>(std::move(drawn)));
    } else {
      Refuse(std::move(drawn), cell);
    }
    return true;
  };
  const auto are_near = [&](size_t i, size_t j) {
    return Norm(gaps[i].sample - gaps[j].sample) < kSeenAround;
  };
  TakeLookingAhead<Found>(gaps.size(), run, are_near, look, holds, take);
  known_ = complex.vertices;
  return !moves.empty();
}

// Nothing that decided has changed since.
bool JointDraw::Holds(const Found& found, int32_t cell) const {
  if (found.cell != cell || !found.drawn.has_value()) return false;
  return RefusalAt(cell).asked_at <= found.looked_at &&
         HasStayed(found.drawn->seen, found.looked_at);
}

void JointDraw::Move(const DrawnPlace& drawn, int32_t cell) {
  MoveTo(drawn, placement_);
  refusals_.erase(cell);
  ++clock_;
  for (const int32_t v : drawn.moving) changed_[v] = clock_, moved_[v] = 1;
}

void JointDraw::Refuse(DrawnPlace drawn, int32_t cell) {
  Refusal& refusal = refusals_[cell];
  if (drawn.outcome == DrawnPlace::Outcome::kStayed) refusal.lacked = drawn.lacked;
  refusal.asked_at = ++clock_;
  refusal.seen = std::move(drawn.seen);
}

// Those since the last call that others have made.
void JointDraw::NoteMoves() {
  ++clock_;
  for (size_t v = 0; v < known_.size(); ++v) {
    if (known_[v] != placement_.complex.vertices[v]) changed_[v] = clock_;
  }
}

const JointDraw::Refusal& JointDraw::RefusalAt(int32_t cell) const {
  static const Refusal kNone;
  const auto found = refusals_.find(cell);
  return found == refusals_.end() ? kNone : found->second;
}

// All that a refusal saw is where it was.
bool JointDraw::Stands(int32_t cell) const {
  const Refusal& refusal = RefusalAt(cell);
  return !refusal.seen.empty() && HasStayed(refusal.seen, refusal.asked_at);
}

bool JointDraw::HasStayed(const std::vector<int32_t>& vertices, int64_t since) const {
  return std::all_of(vertices.begin(), vertices.end(),
                     [&](int32_t v) { return changed_[v] <= since; });
}

// That of the face nearest to the gap; -1 if there is none near.
int32_t JointDraw::CellAt(const Gap& gap) const {
  const CellComplex& complex = placement_.complex;
  const Vec3d place = (gap.sample + gap.nearest) / 2.0;
  int32_t nearest = -1;
  double least = 1e300;
  sampling_.face_index().VisitNear(place, kFaceSearchReach, [&](int32_t f) {
    const double distance = FaceDistance(complex.hull_faces[f], complex.vertices, place);
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
