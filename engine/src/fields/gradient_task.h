// One solve by conjugate gradients as plain arrays: what crosses the border to the CUDA library
// that is loaded at run time.
#pragma once

#include <cstdint>
#include <functional>
#include <variant>
#include <vector>

#include "base/array_view.h"
#include "exec/resident_slot.h"
#include "fields/grid_keys.h"
#include "fields/linear_operators.h"

namespace amhex::fields {

struct SolveLimits {
  int32_t max_iterations = 0;
  double tolerance = 0;
};

// What the hull wishes of the phases of some nodes; of the others it wishes nothing.
struct HullWishes {
  ArrayView<const int32_t> nodes;
  ArrayView<const float> weights;  // [place among those nodes][axis]
  ArrayView<const float> targets;  // likewise, real and imaginary part, times the weight

  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(nodes), visit(weights), visit(targets);
  }
};

// What the turns of a PhaseOperator and the hull's part of it are made of.
struct PhaseDemands {
  ArrayView<const float> increments;  // [node_count][d][axis] of the lattice form
  HullWishes hull;

  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(increments), hull.VisitArrays(visit);
  }
};

// All solves of one phase field: a plain one from zero, after which weak phases are seeded
// (phase_seeds.h), then rounds, each from where the last one ended and pulled towards the unit
// numbers in its direction. Turns, right sides and diagonals follow from that.
struct PhaseCourse {
  PhaseDemands demands;
  SolveLimits first;                            // of the plain solve
  std::vector<float> pulls;                     // by round
  std::function<void(int32_t round)> on_round;  // may be empty; called before each
};

// Solves start at zero. Views are on host arrays that outlive the task.
struct GradientTask {
  LinearOperator matrix;
  ResidentSlot* links = nullptr;  // of the matrix; null: made for this task
  CellCentres cells;  // of a PhaseOperator: links that stay find neighbours there; or empty
  int64_t node_count = 0;
  // Of a PhaseOperator, of which all but the links follows from this. Or:
  const PhaseCourse* course = nullptr;
  ArrayView<const float> right_side;  // [unknown_count]
  std::vector<float>* x = nullptr;    // out: [unknown_count]; as it was unless it was done
  SolveLimits limits;                 // of each solve, but for the first of a course
  std::function<bool()> should_stop;  // may be empty
  int32_t iterations = 0;             // out: of the last solve

  int64_t unknown_count() const {
    return std::visit([this](const auto& of) { return node_count * of.kUnknowns; }, matrix);
  }
};

}  // namespace amhex::fields
