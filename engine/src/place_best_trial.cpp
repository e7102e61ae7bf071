#include "place_best_trial.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include "base/status_macros.h"
#include "closure/close_complex.h"
#include "cuda/device_use.h"
#include "optimize/hull_features.h"
#include "optimize/improve_mesh.h"
#include "optimize/raise_quality.h"
#include "place_candidates.h"
#include "placed_loss.h"
#include "refill_trial.h"
#include "stage.h"

namespace amhex {
namespace {

// Of so many trials the best one is taken where the first keeps a poor cell or stays too far from
// the hull, and the next ones, too; of more where a part of the solid is lost, or none is valid.
constexpr size_t kLeastChoice = 3;
constexpr size_t kLeastChoiceOfLost = 5;

// A mesh that keeps a cell below kGoodMinimum at last costs so much more than one that keeps none:
// as much as a hundredth of the average.
constexpr double kLossOfPoor = 0.01;

// Where many places stay too far from the hull, as of a solid with few cells across, they do so in
// the next ones, too: no reason to try these, unless one is so far that it costs more than this.
constexpr double kLittleDistance = 0.01;

// The best valid one so far.
struct Best {
  std::optional<CellComplex> complex;
  PlacedLoss loss;
  int64_t closed_others = 0;

  bool is_whole() const { return complex.has_value() && loss.lost == 0; }
  double total() const {
    return complex.has_value() ? loss.total() : std::numeric_limits<double>::infinity();
  }

  // What the cells of another closed trial cost goes with how many are no hexahedra, mostly. With
  // so many it would have to be better than that.
  double MostOthers() const {
    if (!complex.has_value() || closed_others == 0 || loss.cells == 0) {
      return std::numeric_limits<double>::infinity();
    }
    return static_cast<double>(closed_others) * loss.total() / loss.cells;
  }

  void Update(PlacedCandidate next) {
    if (next.loss.total() >= total()) return;
    complex = std::move(next.complex);
    loss = next.loss;
    closed_others = next.closed_others;
  }
};

// The trials in the order of their turns: those that were placed beside each other, the other
// closed ones, those that wait, those that resist while nothing else is valid, the spare one; each
// is brought as far as that when its turn comes.
class Turns {
 public:
  Turns(const std::vector<CellComplex>& assemblies, ClosedTrials trials, PlacedCandidates placed,
        const SpareTrial& spare, const Improvement& with)
      : assemblies_(assemblies),
        make_spare_(spare),
        closed_(std::move(trials.closed)),
        waiting_(std::move(trials.waiting)),
        resisting_(std::move(trials.resisting)),
        placed_(std::move(placed.candidates)),
        cost_(placed.cost),
        with_(with) {}

  // How many have a turn, of all that there are, where a choice of `least` is wanted.
  size_t Count(size_t least) const {
    return std::max(placed_.size(), std::min(Given() + (make_spare_ ? 1 : 0), least));
  }

  // Whether turn `i` is of one that has been assembled beside the first.
  bool IsAssembled(size_t i) const { return i < Given(); }

  const CellComplex& Assembly(size_t index) const {
    return index < assemblies_.size() ? assemblies_[index] : spare_.complexes.front();
  }
  const std::vector<std::string>& device_notes() const { return spare_.device_notes; }

  // Turn `i`, after those before it. Nothing where the trial cannot be closed, or is not likely to
  // be better than the best one when it is refilled and followed.
  absl::StatusOr<std::optional<PlacedCandidate>> Take(size_t i, const Best& best, RunContext& run) {
    AMHEX_ASSIGN_OR_RETURN(std::optional<PlacedCandidate> next, Place(i, best, run));
    if (next.has_value() && LeastLikely(*next, best) >= best.total()) next.reset();
    return next;
  }

 private:
  size_t Given() const { return closed_.size() + waiting_.size() + resisting_.size(); }

  // What refilling mends of one that has not been drawn to the hull is not known before. Where the
  // best one stays too far from it, that is hoped for.
  double LeastLikely(const PlacedCandidate& next, const Best& best) const {
    return best.loss.distance > 0 ? next.loss.cells : LikelyTotal(next, cost_);
  }

  absl::StatusOr<std::optional<PlacedCandidate>> Place(size_t i, const Best& best,
                                                       RunContext& run) {
    if (i < placed_.size()) return std::optional<PlacedCandidate>(std::move(placed_[i]));
    size_t assembly;
    CellComplex complex;
    if (i < closed_.size()) {
      assembly = closed_[i].assembly;
      complex = std::move(closed_[i].complex);
    } else {
      const size_t turn = i - closed_.size();
      if (i == Given()) {
        if (!AssembleSpare()) return std::optional<PlacedCandidate>();
        assembly = assemblies_.size();
      } else if (turn < waiting_.size()) {
        assembly = waiting_[turn];
      } else {
        if (best.complex.has_value()) return std::optional<PlacedCandidate>();
        assembly = resisting_[turn - waiting_.size()];
      }
      const Closing closing{.may_fail = best.complex.has_value(), .most_others = best.MostOthers()};
      absl::StatusOr<CellComplex> late =
          CloseComplex(Assembly(assembly), with_.hull, with_.params, run, closing);
      AMHEX_RETURN_IF_ERROR(run.CheckStop());
      if (!late.ok()) return std::optional<PlacedCandidate>();
      complex = *std::move(late);
    }
    const int64_t others = CountOthers(complex);
    if (static_cast<double>(others) >= best.MostOthers()) return std::optional<PlacedCandidate>();
    AMHEX_ASSIGN_OR_RETURN(ImprovedMesh improved, ImproveMesh(std::move(complex), with_, run));
    const PlacedLoss loss = LossOf(improved.complex, with_, kMendableMinimum, StopPoll(run));
    return std::optional<PlacedCandidate>({.assembly = assembly,
                                           .complex = std::move(improved.complex),
                                           .closed_others = others,
                                           .is_defective = improved.is_defective,
                                           .loss = loss});
  }

  // Whether there is one; what failed is no worse than not to have it.
  bool AssembleSpare() {
    absl::StatusOr<AssembledTrials> spare = make_spare_();
    if (spare.ok()) spare_ = *std::move(spare);
    return !spare_.complexes.empty();
  }

  const std::vector<CellComplex>& assemblies_;
  const SpareTrial& make_spare_;
  AssembledTrials spare_;  // once its turn has come
  std::vector<ClosedTrial> closed_;
  std::vector<size_t> waiting_;
  std::vector<size_t> resisting_;
  std::vector<PlacedCandidate> placed_;
  CostOfFollowing cost_;
  Improvement with_;
};

// Of the assemblies, all of which broke the law with their first filling, the first one with a
// valid filling; the last attempt where there is none.
absl::StatusOr<CellComplex> FillFirstAnew(const Turns& turns, const std::vector<size_t>& broken,
                                          const Improvement& with, RunContext& run) {
  absl::StatusOr<RefilledTrial> last =
      absl::InternalError("no valid mesh was found; try another cell count");
  for (size_t i = 0; i < broken.size() && !(last.ok() && last->is_valid); ++i) {
    absl::StatusOr<RefilledTrial> next = FillAnew(turns.Assembly(broken[i]), with, run);
    AMHEX_RETURN_IF_ERROR(run.CheckStop());
    if (next.ok() || !last.ok()) last = std::move(next);
  }
  AMHEX_RETURN_IF_ERROR(last.status());
  return std::move(last->complex);
}

// What the turns come to.
class Choice {
 public:
  Choice(const Turns& turns, const Improvement& with, RunContext& run)
      : turns_(turns), with_(with), run_(run), has_choice_(turns.Count(kLeastChoice) > 1) {}

  // Refills what had turn `i`. True where no other one is needed.
  absl::StatusOr<bool> Refill(PlacedCandidate next, size_t i) {
    AMHEX_ASSIGN_OR_RETURN(RefilledTrial refilled,
                           RefillTrial(next.complex, next.is_followed, with_, run_));
    if (!refilled.is_valid) {
      broken_.push_back(next.assembly);
      return false;
    }
    next.complex = std::move(refilled.complex);
    next.loss = {};
    if (has_choice_) next.loss = LossOf(next.complex, with_, kGoodMinimum, StopPoll(run_));
    const double minimum = SummarizeQuality(next.complex, StopPoll(run_)).minimum;
    if (minimum < kGoodMinimum) next.loss.minimum += kLossOfPoor;
    const bool is_near_enough =
        next.loss.distance == 0 || with_.features.points_scatter() || i + 1 >= kLeastChoice ||
        (refilled.is_far_in_many_places && next.loss.distance < kLittleDistance);
    // More is asked where another one is at hand.
    const double least = with_.params.assembly.min_quality;
    const double wanted = turns_.IsAssembled(i + 1) ? std::max(least, kGoodMinimum) : least;
    const bool is_good =
        next.loss.lost == 0 && next.loss.handles == 0 && is_near_enough && minimum >= wanted;
    best_.Update(std::move(next));
    return is_good;
  }

  const Best& best() const { return best_; }
  const std::vector<size_t>& broken() const { return broken_; }
  CellComplex Take() { return *std::move(best_.complex); }

 private:
  const Turns& turns_;
  const Improvement& with_;
  RunContext& run_;
  const bool has_choice_;
  Best best_;
  std::vector<size_t> broken_;  // assemblies whose filling has broken the law
};

absl::StatusOr<PlacedTrial> BestOf(const std::vector<CellComplex>& assemblies, ClosedTrials trials,
                                   const SpareTrial& spare, const Improvement& with,
                                   RunContext& run) {
  AMHEX_ASSIGN_OR_RETURN(PlacedCandidates placed, PlaceCandidates(trials.closed, with, run));
  Turns turns(assemblies, std::move(trials), std::move(placed), spare, with);
  Choice choice(turns, with, run);
  // Few of these become valid: refilled where nothing else is.
  std::vector<PlacedCandidate> defective;
  bool is_good = false;
  for (size_t i = 0;
       !is_good && i < turns.Count(choice.best().is_whole() ? kLeastChoice : kLeastChoiceOfLost);
       ++i) {
    AMHEX_ASSIGN_OR_RETURN(std::optional<PlacedCandidate> next, turns.Take(i, choice.best(), run));
    if (!next.has_value()) continue;
    if (next->is_defective) {
      defective.push_back(*std::move(next));
      continue;
    }
    AMHEX_ASSIGN_OR_RETURN(is_good, choice.Refill(*std::move(next), i));
  }
  for (size_t i = 0; i < defective.size() && !choice.best().complex.has_value(); ++i) {
    AMHEX_RETURN_IF_ERROR(choice.Refill(std::move(defective[i]), kLeastChoice).status());
  }
  if (choice.best().complex.has_value()) return PlacedTrial{choice.Take(), turns.device_notes()};
  AMHEX_ASSIGN_OR_RETURN(CellComplex filled, FillFirstAnew(turns, choice.broken(), with, run));
  return PlacedTrial{std::move(filled), turns.device_notes()};
}

}  // namespace

absl::StatusOr<PlacedTrial> PlaceBestTrial(const std::vector<CellComplex>& assemblies,
                                           ClosedTrials trials, const Hull& hull,
                                           const MeshingParams& params, RunContext& run,
                                           const SpareTrial& spare) {
  return GuardStage(run, Stage::kPlaceVertices, [&]() -> absl::StatusOr<PlacedTrial> {
    AMHEX_ASSIGN_OR_RETURN(DeviceUse device, DeviceUse::Choose(params.run.backend));
    const HullFeatures features(hull, StopPoll(run));
    const Improvement with{hull, features, params, &device};
    AMHEX_ASSIGN_OR_RETURN(PlacedTrial best,
                           BestOf(assemblies, std::move(trials), spare, with, run));
    const std::vector<std::string> notes = device.notes();
    best.device_notes.insert(best.device_notes.end(), notes.begin(), notes.end());
    return best;
  });
}

}  // namespace amhex
