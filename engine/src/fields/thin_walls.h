// Cells that are as high as a wall is thick, where a whole cell would not fit.
#pragma once

#include "absl/status/status.h"
#include "fields/background_grid.h"
#include "fields/lattice_form.h"
#include "fields/orientation_field.h"
#include "input/hull_queries.h"

namespace amhex::fields {

// In walls with parallel sides, thinner than the form's cells but no thinner than the grid's
// spacing, the cells' axis across the wall gets the wall's thickness: the layers below either side
// are then one and the same, where they would lie beside each other and cancel out otherwise. (The
// paper, appendix B.6, hopes for one layer there if the samples are dense.) O(nodes log triangles).
// Errors: CANCELLED, DEADLINE_EXCEEDED.
absl::Status FitThinWalls(const HullQueries& hull, const BackgroundGrid& grid,
                          const ForwardCodes& codes, const RunContext& run, LatticeForm* form);

}  // namespace amhex::fields
