// Trials: a run starts several lattices of slightly different density and makes the mesh from the
// one that fits the solid best. Each step goes on with fewer of them.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "fields/field_sites.h"
#include "input/hull.h"
#include "relax/sites.h"

namespace amhex {

// How many trials take part in which step. Further ones do as long as they are little work, which
// they are on solids that lattices fit.
struct TrialPlan {
  TrialCount started;  // populated and assembled
  int closed = 1;      // at least, unless fewer can be
  // Whether another one is assembled where the usual one, if it is the only one, turns out poor.
  bool has_spare = false;
};

// How many trials a run of about so many cells is expected to start.
int CountOfTrials(double cell_count, const MeshingParams& params);

// What `params` ask for or, with trial_count 0, the more the smaller the solid; of large ones two,
// of which the second may be a spare. One only with starts other than the field start.
TrialPlan PlanTrials(const Hull& hull, const MeshingParams& params);

struct AssembledTrials {
  std::vector<CellComplex> complexes;     // of those trials that came this far, one at least
  std::vector<std::string> device_notes;  // what the device had no room for, each once
};

// Stages populate to assemble.
absl::StatusOr<AssembledTrials> AssembleTrials(const Hull& hull, const HullSamples& samples,
                                               const TrialPlan& plan, const MeshingParams& params,
                                               RunContext& run);

// The trial after the usual ones, as part of the stage that runs.
absl::StatusOr<AssembledTrials> AssembleSpare(const Hull& hull, const HullSamples& samples,
                                              const TrialPlan& plan, const MeshingParams& params,
                                              RunContext& run);

struct ClosedTrial {
  size_t assembly = 0;  // index of the complex it comes from
  CellComplex complex;
};

struct ClosedTrials {
  std::vector<ClosedTrial> closed;  // best first
  std::vector<size_t> waiting;      // assemblies that are still open, best first
  std::vector<size_t> resisting;    // those that only the last resort would close
};

// Stage close: the most promising assemblies, closed. One that cannot be closed is dropped as long
// as another can.
absl::StatusOr<ClosedTrials> CloseTrials(const std::vector<CellComplex>& assemblies,
                                         const Hull& hull, const TrialPlan& plan,
                                         const MeshingParams& params, RunContext& run);

}  // namespace amhex
