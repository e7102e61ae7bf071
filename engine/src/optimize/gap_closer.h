// Closes gaps between hull and boundary: single vertices of the boundary move, if need be with
// those inside giving way.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "optimize/hull_deviation.h"
#include "optimize/placement.h"
#include "optimize/placement_view.h"
#include "optimize/press_vertex.h"
#include "optimize/seen_vertices.h"

namespace amhex {

// Gaps are looked at from this share of the limit on.
inline constexpr double kWorthLooking = 0.9;

// Places across the worst gaps around a vertex that it would be better at; none for one that may
// not move.
struct GapChoices {
  struct Choice {
    Vec3d place;
    double cost;
  };
  double reach = -1;  // of what was looked at; < 0: nothing was
  Deviation here;
  bool is_missed = false;  // something around is farther off than it may be
  std::vector<Choice> places;
};

// What closing a gap looked at and did, so that it need not be found out again.
struct GapRecord {
  struct Move {
    int32_t vertex;
    Vec3d place;
  };
  struct Step {
    int32_t vertex;
    std::optional<GapChoices> choices;  // what it was found to have, unless that was known
    std::vector<Move> moves;            // behind the vertex's own those of vertices that give way
    bool was_in_vain = false;           // it was pressed, and stayed
  };
  std::vector<int32_t> seen;  // vertices whose places decided
  std::vector<Step> steps;
};

class GapCloser {
 public:
  // `placement`'s cells, constraints and faces must be those of the sampling. Cells that are better
  // do not fall below `floor`. All three must outlive this.
  GapCloser(Placement& placement, const HullSampling& sampling, const DeviationLimits& limits,
            double floor);

  // Moves vertices around the gap. The record holds until the next call, and may be changed.
  GapRecord& Close(const Gap& gap);
  // Does what another one has done that found everything seen at the same places.
  void Repeat(GapRecord& record);
  // Becomes as the other is at the vertices of the steps.
  void TakeFrom(const GapCloser& other, const std::vector<GapRecord::Step>& steps);
  // Knows what the other does, whose placement is as its own.
  void TakeAllFrom(const GapCloser& other);

  // Tells that a vertex has moved.
  void NoteChange(int32_t v) { changed_[v] = ++clock_; }
  int64_t clock() const { return clock_; }  // changes so far
  bool HasChanged(const std::vector<int32_t>& vertices, int64_t since) const;
  // [vertex] 1: moved onto a place that was chosen.
  const std::vector<uint8_t>& moved() const { return moved_; }

 private:
  // That a vertex has found no better place, or none that those inside make room for.
  struct Refusal {
    GapChoices choices;
    int64_t asked_at = 0;     // by clock_
    int64_t pressed_at = -1;  // the same; < 0: it was not pressed
  };

  void SeeAround(int32_t v);
  std::vector<int32_t> VerticesAround(const Gap& gap);
  bool StandsRefused(int32_t v);
  template <class Cells>
  bool HasChangedAt(const Cells& cells, int64_t since) const;
  bool IsOnFeature(int32_t v) const;
  GapChoices ChoicesFor(int32_t v) const;
  void Ask(int32_t v);
  std::vector<Vec3d> Candidates(const Vec3d& start, const VertexDeviation& deviation) const;
  Vec3d NearestOnCreases(const Vec3d& p) const;
  bool MoveVertex(int32_t v);
  std::optional<Vec3d> BestPlace(int32_t v, const GapChoices& choices);
  bool PressVertex(int32_t v);
  void NoteMoves(const std::vector<GapRecord::Move>& moves);

  Placement& placement_;
  const HullSampling& sampling_;
  const DeviationLimits& limits_;
  const PlacementView view_;
  const double floor_;
  std::vector<uint8_t> moved_;
  std::vector<int64_t> changed_;   // [vertex] when it last moved, by clock_
  std::vector<Refusal> refusals_;  // [vertex]
  int64_t clock_ = 0;
  VertexPress press_;
  GapRecord record_;
  SeenVertices seen_;
};

}  // namespace amhex
