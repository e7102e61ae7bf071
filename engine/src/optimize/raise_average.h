// The average quality of cells that stay as they are, raised by moving vertices.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "optimize/hull_features.h"
#include "optimize/vertex_search.h"

namespace amhex {

class DeviceUse;

// Only vertices with a cell below this are moved for the average.
inline constexpr double kAverageTarget = 0.99;

// Bounds of the cells' minima, from one that large steps lower to one that tells much the same.
inline constexpr CornerPenalty kLooseBound = {.kind = EnergyKind::kMinima};
inline constexpr CornerPenalty kCloseBound = {.kind = EnergyKind::kMinima, .sharpness = 4};
inline constexpr CornerPenalty kClosestBound = {.kind = EnergyKind::kMinima, .sharpness = 5};

// Good cells may give way where the sum gains; poor ones and the minimum may not.
SweepRules RulesForAverage(const CellComplex& complex, const CornerPenalty& bound,
                           const StopPoll& poll);

// For a complex whose vertices are placed (place_vertices.h) and that is to be the result: moves
// them on by a few sweeps with closer bounds and for smaller gains than pay while candidates are
// compared. Errors: CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<CellComplex> RaiseAverage(CellComplex complex, const HullFeatures& features,
                                         const RunContext& run, DeviceUse* device);

}  // namespace amhex
