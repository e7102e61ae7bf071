// Which of the closed trials are placed, and which of these is best.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "cost_of_following.h"
#include "input/hull.h"
#include "optimize/improve_mesh.h"
#include "placed_loss.h"
#include "trials.h"

namespace amhex {

// Closing takes time for every open face, placing for every cell that is no hexahedron: once those
// of the trials that have had their turn, and of the next one, are more, no further one has it.
struct LittleWork {
  int closed;  // at least
  int64_t open_faces;
  int64_t others;
};
const LittleWork& LittleWorkOf(const Hull& hull);

struct PlacedCandidate {
  size_t assembly = 0;
  CellComplex complex;
  int64_t closed_others = 0;  // cells that were no hexahedra before it was placed
  bool is_defective = false;  // ImprovedMesh
  bool is_followed = false;   // its boundary is drawn to the hull
  PlacedLoss loss = {};       // where there is a choice
};

int64_t CountOthers(const CellComplex& complex);

// What it is once the candidate is followed, or is likely to be.
double LikelyTotal(const PlacedCandidate& candidate, const CostOfFollowing& cost);

struct PlacedCandidates {
  std::vector<PlacedCandidate> candidates;  // least likely total first
  CostOfFollowing cost;                     // as far as it has been learnt
};

// Of the closed trials, best first, those that are worth placing. They are the first of `closed`,
// and taken from there. Errors: CANCELLED, DEADLINE_EXCEEDED, INTERNAL.
absl::StatusOr<PlacedCandidates> PlaceCandidates(std::vector<ClosedTrial>& closed,
                                                 const Improvement& with, RunContext& run);

}  // namespace amhex
