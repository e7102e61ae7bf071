// Moves a vertex of the boundary where the cells around it only admit it once the vertices inside
// give way.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "amhex/vec3.h"
#include "optimize/placement.h"
#include "optimize/vertex_search.h"

namespace amhex {

class VertexPress {
 public:
  // No cell that is better may fall below `floor`. `placement` must outlive this; what may move is
  // what its constraints leave free, and they stay as they are. The survey is brought up to date
  // where vertices move.
  VertexPress(Placement& placement, double floor);

  // The vertex at `place`, with the vertices inside up to two cells around it where they are best
  // then. Kept if no cell there folds or is both below the floor and the worst before, no face
  // turns away from the hull, the sum of what the cells lack to a scaled Jacobian of 1 grows by
  // `most_loss` at most, and `accepts` says so of the placement as it is then; otherwise all is as
  // it was. Returns whether it was kept. Work: that of a few dozen vertices.
  bool Run(
      int32_t vertex, const Vec3d& place, double most_loss,
      const std::function<bool()>& accepts = [] { return true; });

  // All cells that the attempt at a vertex looks at, ascending, until the next call.
  const std::vector<int32_t>& CellsAround(int32_t vertex);

  // The vertices that may have made room the last time.
  const std::vector<int32_t>& inner() const { return inner_; }

 private:
  struct Bounds {
    double least;      // scaled Jacobian of the cells around
    double most_lack;  // sum of what they lack to 1
  };
  bool Settle(const Bounds& bounds);
  void CollectAround(int32_t vertex);
  void Survey();
  void SurveyAt(int32_t vertex);
  void Sweep(const SweepRules& rules, int count);
  bool VisitEach(const SweepVisits& sweep);
  void NoteMove(int32_t vertex);
  void SurveyTouched();
  void KeepState();
  void TakeBack();
  double Least() const;  // scaled Jacobian of the cells
  bool NoneFolds() const;
  double Lack() const;

  Placement& placement_;
  const PlacementView view_;
  const double floor_;
  std::vector<uint8_t> active_, moved_;  // [vertex] what visits want to have
  std::vector<float> step_;              // [vertex]
  std::vector<uint8_t> is_touched_;      // [cell] has a vertex that moved in this sweep
  std::vector<int32_t> touched_;         // those cells
  int32_t around_ = -1;                  // the vertex that inner_ and cells_ are of
  std::vector<int32_t> inner_;           // vertices that give way, ascending
  std::vector<int32_t> cells_;           // all at those and at the one that is moved, ascending
  std::vector<Vec3d> before_;            // where inner_ were
  struct CellSurvey {
    float min_scaled_jacobian;
    uint8_t near_folding;
  };
  std::vector<CellSurvey> survey_before_;  // of cells_
};

}  // namespace amhex
