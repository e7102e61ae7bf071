// Where the lattice of cells stands at every node: three phases, the sites being where all vanish.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "fields/background_grid.h"
#include "fields/lattice_form.h"
#include "fields/phase_course.h"

namespace amhex::fields {

struct PhaseSettings {
  double hull_weight = 20;     // of "centres half a cell below the hull" against one edge
  int first_iterations = 300;  // of the plain solve
  double first_tolerance = 5e-5;
  int rounds = 8;  // of rising pull to unit length
  double first_pull = 0.02;
  double last_pull = 1.0;
  int round_iterations = 40;
  double round_tolerance = 1e-3;
};

// With progress as `slice` is to be told of it.
PhaseCourse CourseOf(const PhaseSettings& settings, const ProgressSlice& slice);

// [node_count] for each node the position in space of the lattice point (a cell centre) that it is
// nearest to. `codes` are those the form was made with; frames may have moved since.
absl::StatusOr<std::vector<Vec3d>> SolvePhaseField(const BackgroundGrid& grid,
                                                   const ForwardCodes& codes,
                                                   const LatticeForm& form,
                                                   const PhaseSettings& settings,
                                                   const ProgressSlice& slice);

}  // namespace amhex::fields
