// How the phases of a field are solved for, wherever that is.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "fields/gradient_task.h"
#include "fields/phase_bodies.h"

namespace amhex::fields {

// What the turns of a PhaseOperator and the hull's part of it are made of.
struct PhaseDemands {
  ArrayView<const float> increments;  // [node_count][d][axis] of the lattice form
  HullWishes hull;
};

// A plain solve from zero, after which weak phases are seeded (phase_seeds.h), then rounds, each
// from where the last one ended and pulled towards the unit numbers in its direction. Turns, right
// sides and diagonals follow from that.
struct PhaseCourse {
  double hull_weight = 0;  // of the hull's wishes
  SolveLimits first;       // of the plain solve
  SolveLimits later;
  std::vector<float> pulls;                     // by round
  std::function<void(int32_t round)> on_round;  // may be empty; called before each
};

}  // namespace amhex::fields
