// The vertices around poor cells, to be moved together: what the cells lack, how that changes with
// the vertices, and what no move may break.
#pragma once

#include <cstdint>
#include <vector>

#include "optimize/cell_measures.h"
#include "optimize/hinge_fit.h"
#include "optimize/placement.h"
#include "optimize/vertex_search.h"

namespace amhex {

// Of the cells and hull faces of a place, as the vertices are.
struct PlaceJudgement {
  double lack = 0;                  // to what is wanted, squared, over all corners
  double least = 1;                 // scaled Jacobian
  std::vector<double> fold_margin;  // [cell]
  std::vector<double> agreement;    // [moving vertex] WorstNormalAgreement
  std::vector<double> sag;          // [hull face] 0 where it may sag freely
};

// Something else that is wanted of the vertices, and how that falls as they move.
struct VertexRow {
  double lack = 0;  // what is not positive counts for nothing
  struct Slope {
    int32_t vertex = 0;
    Vec3d fall;  // of the lack, as the vertex moves
  };
  std::vector<Slope> slopes;  // each vertex once
};

// One object for one place after the other; the placement must outlive it.
class JointPlace {
 public:
  explicit JointPlace(Placement& placement);

  // What moves and what is looked at in the place of these cells: vertices, ascending.
  struct Extent {
    std::vector<int32_t> moving, seen;
  };
  Extent ExtentOf(const std::vector<int32_t>& poor);

  // Goes to the place of these cells. What may move are their vertices and those of the cells at
  // them, as far as constraints admit.
  void Enter(const std::vector<int32_t>& poor);
  // The same, but vertices that are on no crease or corner may leave the hull, whose faces may sag;
  // scaled Jacobians may fall to `floor`.
  void EnterLoosely(const std::vector<int32_t>& cells, double floor);
  // Brings the survey up to date.
  void Leave();

  bool MayMove() const { return !moving_.empty(); }
  const std::vector<int32_t>& moving() const { return moving_; }  // vertices, ascending
  // Those of the cells at them, whose places decide what is judged here.
  std::vector<int32_t> Seen() const;
  // What the cells lack to a scaled Jacobian of 1, each at its worst corner.
  double LackOfCells() const;
  PlaceJudgement Judge(double wanted) const;
  // Whether less is lacking in `then` than in `now`, and nothing is broken that was not when the
  // place was entered: cells that fold, a lower least scaled Jacobian, hull faces that turn from
  // the hull or sag.
  bool IsPermittedGain(const PlaceJudgement& now, const PlaceJudgement& then) const {
    return then.lack < now.lack && IsPermitted(then);
  }
  bool IsPermitted(const PlaceJudgement& then) const;

  // What the corners lack to what is wanted, and what must not be broken, as linear functions of
  // moves from here. `now`: judged here.
  HingeFit FitHere(const PlaceJudgement& now, double wanted,
                   const std::vector<VertexRow>& others = {});
  // The next fits of this place keep more firmly to what must not be broken; false if they do
  // already.
  bool GuardMoreFirmly();
  // Moves the vertices as a fit of here has it, all by the same share where one would move far.
  void Move(const std::vector<Vec3d>& moves);

  std::vector<Vec3d> Positions() const;
  void MoveBack(const std::vector<Vec3d>& positions);

 private:
  using Rows = std::vector<HingeRow>;
  void Collect(const std::vector<int32_t>& cells);
  void Forget();
  VertexConstraint ConstraintOf(int32_t vertex) const;
  void AppendCorners(int32_t cell, double wanted, Rows* rows, Rows* guards) const;
  void AppendFoldGuard(int32_t cell, double now, double least, Rows* rows);
  void AppendAgreementGuard(int32_t vertex, double now, double least, Rows* rows);
  void AppendSagGuard(int32_t face, double most, Rows* rows) const;
  // Forward differences of change(), which is 0 as the vertices are.
  template <class Change>
  void AppendDifferences(const std::vector<int32_t>& vertices, double weight, HingeRow* row,
                         const Change& change);
  // What of it is along the ways that are open to the vertex.
  void AppendSlope(int32_t vertex, const Vec3d& fall, HingeRow* row) const;

  double LeastMargin(size_t cell) const { return Smaller(0.0, start_.fold_margin[cell]); }
  double LeastAgreement(size_t vertex) const;
  Vec3d MiddleOf(int32_t face) const;
  CellPositions PositionsOf(int32_t cell) const;

  struct Freedom {
    VertexConstraint constraint;
    FreeAxes axes;
    Vec3d foot;    // where the constraint admits the vertex, nearest to it
    Vec3d offset;  // of the vertex from there
  };

  const PlacementView view_;
  std::vector<int32_t> point_of_;       // [vertex] index into moving_; -1: it stays
  std::vector<int32_t> moving_;         // vertices, ascending
  std::vector<int32_t> cells_, faces_;  // all at those, ascending
  std::vector<Freedom> freedoms_;       // [index into moving_] where the last fit was made
  PlaceJudgement start_;                // its lack is not used
  bool is_loose_ = false;
  double firmness_ = 1;  // of the guards
};

}  // namespace amhex
