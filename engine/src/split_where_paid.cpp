#include "split_where_paid.h"

#include <utility>

#include "base/status_macros.h"
#include "base/stop_poll.h"
#include "optimize/split_at_gaps.h"
#include "placed_loss.h"

namespace amhex {

absl::StatusOr<CellComplex> SplitWherePaid(CellComplex complex, const Improvement& with,
                                           double good_minimum, const RunContext& run) {
  AMHEX_ASSIGN_OR_RETURN(CellComplex split, SplitAtGaps(complex, with.hull, with.features, run));
  if (split.cells.size() == complex.cells.size()) return complex;
  const StopPoll poll(run);
  const double before = LossOf(complex, with, good_minimum, poll).total();
  const double after = LossOf(split, with, good_minimum, poll).total();
  return after < before ? std::move(split) : std::move(complex);
}

}  // namespace amhex
