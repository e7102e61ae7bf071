// Draws the boundary to the hull where moves of single vertices gain little: all vertices around a
// gap move together, and the cells below them give way.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "amhex/run_context.h"
#include "optimize/draw_place.h"
#include "optimize/hull_deviation.h"
#include "optimize/placement.h"

namespace amhex {

class JointDraw {
 public:
  // No cell that is better may fall below `floor`. All must outlive this; cells, constraints and
  // faces must be those of the sampling.
  JointDraw(Placement& placement, const HullSampling& sampling, const DeviationLimits& limits,
            double floor, FaceDetail detail = FaceDetail::kFew);

  // One place after the other, in the order of the gaps, though they are looked at side by side
  // before: its vertices move by least squares until
  // hull, creases and boundary are as near as they should be all around it, or nothing is gained.
  // Vertices on no crease may leave the hull by as much as does not count, which brings faces
  // nearer whose corners alone lie on it. A place where something is lost (gap_closer) stays, and
  // so does one that costs its cells more than it is worth. The survey is brought up to date where
  // vertices move. Ends early when the run is to stop. Returns whether any place has moved.
  //
  // Nothing moves where gaps are everywhere. Work: some tens of steps over the cells of a few dozen
  // vertices for a gap, for a fiftieth as many gaps as there are cells at most, or 96.
  bool Run(const std::vector<Gap>& gaps, const RunContext& run);

  // [vertex] 1: moved so far.
  const std::vector<uint8_t>& moved() const { return moved_; }

 private:
  // That a place has stayed.
  struct Refusal {
    double lacked = -1;         // when it was last tried; < 0: it was not
    int64_t asked_at = 0;       // by clock_
    std::vector<int32_t> seen;  // vertices whose places decided
  };
  // What was found at a gap before its turn.
  struct Found {
    int32_t cell = -1;
    int64_t looked_at = 0;  // by clock_
    std::optional<DrawnPlace> drawn;
  };
  struct Rehearsal;

  int32_t CellAt(const Gap& gap) const;
  bool Holds(const Found& found, int32_t cell) const;
  void Move(const DrawnPlace& drawn, int32_t cell);
  void Refuse(DrawnPlace drawn, int32_t cell);
  const Refusal& RefusalAt(int32_t cell) const;
  bool Stands(int32_t cell) const;
  bool HasStayed(const std::vector<int32_t>& vertices, int64_t since) const;
  void NoteMoves();

  Placement& placement_;
  const HullSampling& sampling_;
  const DeviationLimits& limits_;
  const double floor_;
  const FaceDetail detail_;
  std::vector<uint8_t> moved_;
  std::map<int32_t, Refusal> refusals_;  // [cell] at the gap
  std::vector<Vec3d> known_;             // [vertex] where it was when moves were last noted
  std::vector<int64_t> changed_;         // [vertex] when it last moved, by clock_
  int64_t clock_ = 0;
};

}  // namespace amhex
