// The guarantee: whatever assembly left open is filled, or the run fails with the place.
//
// Cheapest repair first: loose cells go, faces near the hull snap to it, small cavities become
// stars, large networks of slits are carved into stars part by part, what resists is cleared of the
// cells around and filled anew, and what remains becomes Delaunay tetrahedra, whose slits stars
// close again. Not in the paper, whose assembly ends when no tetrahedron fits any more.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "input/hull.h"

namespace amhex {

struct Closing {
  int attempt = 0;  // a higher one gives another filling, over voids that are that many cells wider
  // Where there are other trials: without the last resort, and with less effort before it.
  bool may_fail = false;
  // Where a better mesh is known: cells other than hexahedra that this one may come to.
  double most_others = std::numeric_limits<double>::infinity();
  // Moves the vertices of a complex without open faces to their places, from any thread. Where it
  // is given, a complex that has none from the beginning is opened at the defects that are left
  // after that only: as assembled, the two sides of a narrow gap may run through each other.
  std::function<absl::StatusOr<CellComplex>(CellComplex)> place = {};
};

// Returns a complex without open faces: every face is shared by two cells or lies on the hull.
// Errors: CANCELLED, DEADLINE_EXCEEDED, INTERNAL (cavities that resist, the message tells where; no
// cell left; more others than permitted, told as soon as there are).
absl::StatusOr<CellComplex> CloseComplex(const CellComplex& complex, const Hull& hull,
                                         const MeshingParams& params, RunContext& run,
                                         const Closing& closing = {});

// The same, but tells nobody of its progress, so that several may run side by side.
absl::StatusOr<CellComplex> CloseUnwatched(const CellComplex& complex, const Hull& hull,
                                           const MeshingParams& params, const RunContext& run,
                                           const Closing& closing = {});

// For a closed complex whose vertices have moved since: opens the mesh `layers` cells around the
// defects of its boundary (boundary_defects.h) and closes it again. Without defects the complex
// comes back as it is. Errors: as CloseComplex.
struct Mended {
  CellComplex complex;
  bool changed = false;
  bool resists = false;  // opened, it could not be closed: it is as it was
};
absl::StatusOr<Mended> MendBoundary(const CellComplex& complex, const Hull& hull, int layers,
                                    const MeshingParams& params, RunContext& run);

// For a complex that is closed but for what `opening` takes out: fills that. Tells nobody of its
// progress, so that several may run side by side. Whether the new cells are better than those taken
// out is for the caller to see. Errors: as CloseComplex.
enum class FirstFilling : uint8_t {
  kStars,    // one star over all of it, if there is one
  kCarving,  // stars over parts of it
};
struct Opening {
  std::vector<int32_t> cells;  // indices into the complex's
  FirstFilling first = FirstFilling::kStars;
};
struct Refilled {
  CellComplex complex;
  // The first filling found nothing, so that the other one comes to the same.
  bool first_was_in_vain = false;
};
absl::StatusOr<Refilled> RefillOpening(const CellComplex& complex, const Hull& hull,
                                       const Opening& opening, const MeshingParams& params,
                                       const RunContext& run);

}  // namespace amhex
