// The default start of the relaxation. Not in the paper: sites that already form a lattice wherever
// one fits, because Lloyd's relaxation only smooths and never changes the structure of the grid.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "input/hull.h"
#include "relax/sites.h"

namespace amhex {

// The most lattices that are tried.
inline constexpr int kMaxTrials = 12;
// Where no more are tried, lattices that are hardly torn make do with fewer.
inline constexpr int kFewTrials = 3;
// Solids of more wanted cells start from one lattice, the frames of which trust the hull's normals
// less than those of the first lattice of smaller ones; a second one has these. Of 35 solids of
// 22,000 to 120,000 cells neither is better than the other in the mean, and the better of both
// gains a thousandth of the average of all cells, for a quarter to a third of the time
// (docs/performance.md).
inline constexpr double kLargeSolid = 2e4;

// How many lattices: `usual` at least, and up to `most` as long as all are torn (ShareOfTornSites).
struct TrialCount {
  int usual = 1;
  int most = 1;
};

// One set of sites per trial, [1, kMaxTrials] of them, from an orientation field, an integrable
// size field, a closed lattice form and a phase field on a background grid of spacing h / 2 (h = 1
// in the normalised frame). The trials differ in density, within 9 % of what was asked for, in how
// firmly their layers follow the hull and, where they are many or the solid is large, in how far
// its normals reach into them; the first has exactly the density asked for. All sites
// lie inside; sizes are the wanted cell extents along the frames' axes; links name the faces to
// glue. A lattice that fits its solid everywhere (whole_lattice.h) and has within 12 % of the
// wanted number of cells ends the trials, and is the only one returned. Of no more than kFewTrials
// so does one that is hardly torn.
//
// Errors: INVALID_ARGUMENT when the hull is too thin for a single node, RESOURCE_EXHAUSTED when
// the grid would be too large, CANCELLED, DEADLINE_EXCEEDED. About 0.6 KB and 60 us per node (one
// core), a third of that time again per further trial; eight nodes per cell.
absl::StatusOr<std::vector<Sites>> PopulateFromFields(const Hull& hull, const HullSamples& samples,
                                                      const TrialCount& count, Backend backend,
                                                      RunContext& run);

// One of those trials, [0, kMaxTrials), alone.
absl::StatusOr<Sites> PopulateTrial(const Hull& hull, const HullSamples& samples, int trial,
                                    Backend backend, RunContext& run);

}  // namespace amhex
