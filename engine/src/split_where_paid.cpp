#include "split_where_paid.h"

#include <optional>
#include <utility>

#include "base/status_macros.h"
#include "base/stop_poll.h"
#include "optimize/draw_rest.h"
#include "optimize/hull_features.h"
#include "optimize/split_at_gaps.h"
#include "placed_loss.h"

namespace amhex {
namespace {

// What mends one place may cost the next.
constexpr int kRounds = 3;
// Of a mesh that comes near enough everywhere, in units of the average.
constexpr double kWorthOfNearness = 0.01;

}  // namespace

absl::StatusOr<CellComplex> SplitWherePaid(CellComplex complex, const Improvement& with,
                                           double good_minimum, const RunContext& run) {
  AMHEX_ASSIGN_OR_RETURN(CellComplex split, SplitAtGaps(complex, with.hull, with.features,
                                                        with.params, SplitTurn::kFirst, run));
  if (split.cells.size() == complex.cells.size()) return complex;
  const StopPoll poll(run);
  const double before = LossOf(complex, with, good_minimum, poll).total();
  const double after = LossOf(split, with, good_minimum, poll).total();
  return after < before ? std::move(split) : std::move(complex);
}

absl::StatusOr<CellComplex> SplitRest(CellComplex complex, const Improvement& with,
                                      const RunContext& run) {
  // There is no end to what noise leaves.
  if (with.features.points_scatter()) return complex;
  const StopPoll poll(run);
  std::optional<PlacedLoss> before;
  for (int round = 0; round < kRounds; ++round) {
    AMHEX_ASSIGN_OR_RETURN(CellComplex split, SplitAtGaps(complex, with.hull, with.features,
                                                          with.params, SplitTurn::kLast, run));
    if (split.cells.size() == complex.cells.size()) break;
    AMHEX_ASSIGN_OR_RETURN(RestDrawn drawn,
                           DrawRest(std::move(split), with.hull, with.features, run));
    split = std::move(drawn.complex);
    if (!before.has_value()) before = LossOf(complex, with, kMendableMinimum, poll);
    const PlacedLoss after = LossOf(split, with, kMendableMinimum, poll);
    const double worth = after.distance == 0 && before->distance > 0 ? kWorthOfNearness : 0.0;
    if (after.total() >= before->total() + worth) break;
    complex = std::move(split);
    before = after;
  }
  return complex;
}

}  // namespace amhex
