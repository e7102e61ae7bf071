#include "optimize/place_refill.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <iterator>
#include <mutex>
#include <utility>

#include "base/status_macros.h"
#include "closure/close_complex.h"
#include "optimize/place_quality.h"
#include "optimize/place_vertices.h"
#include "optimize/stays_near.h"

namespace amhex {
namespace {

// What is tried, until no cell is poor any more; the best of it is kept.
enum class Remedy : uint8_t {
  kJoint,   // the cells stay, vertices around the poor ones move together
  kMove,    // the cells stay, all vertices move, one after the other
  kRepair,  // poor cells and some of their neighbours become other stars
  kRefill,  // the stars of the poor cells, and layers of cells around, are taken out and refilled
};
struct Attempt {
  Remedy remedy;
  int layers = 0;
  FirstFilling first = FirstFilling::kStars;
  bool knows_last = false;  // whether the attempt before came to something
};
constexpr Attempt kAttempts[] = {{Remedy::kJoint},
                                 {Remedy::kMove},
                                 {Remedy::kRepair},
                                 {Remedy::kRefill, 0, FirstFilling::kStars},
                                 {Remedy::kRefill, 0, FirstFilling::kCarving, true},
                                 {Remedy::kRefill, 1, FirstFilling::kStars}};
// One place can afford a wider search than all the mesh can.
constexpr int kRepairDepth = 8;
constexpr int kRepairBeamWidth = 8;
constexpr double kGoodRepair = 0.35;
constexpr double kPoorRepairCost = 300;  // cells per unit
constexpr int kMostLayers = 1;           // of kAttempts
// Rings of cells around what is opened: vertices of the first may move, the others are there to
// be seen: a corner of the hull finds its vertex up to 1.1 edge lengths away.
constexpr int kMovingRings = 2;
constexpr int kSeenRings = 2;
// New boundary faces and moved vertices may cut off or add this many cells. More is added where a
// star had cut a chord off, and cut off where a part of the solid is lost: then distances to the
// hull decide.
constexpr double kMaxVolumeChange = 0.5;
constexpr double kHopelessVolumeChange = 2.0;  // before the vertices have moved

PlacementEffort EffortFor(Remedy remedy) {
  switch (remedy) {
    case Remedy::kJoint:
      return PlacementEffort::kJoint;
    case Remedy::kMove:
      return PlacementEffort::kRaise;
    case Remedy::kRepair:
    case Remedy::kRefill:
      break;
  }
  return PlacementEffort::kValid;
}

// The cells and those that share a face with any of them.
std::vector<int> WithLayer(const WorkingMesh& mesh, const std::vector<int>& cells) {
  std::vector<int> grown = cells;
  for (const int cell : cells) {
    for (const int32_t half : mesh.half_faces(cell)) {
      if (half >= 0 && mesh.owner(half ^ 1) >= 0) grown.push_back(mesh.owner(half ^ 1));
    }
  }
  std::sort(grown.begin(), grown.end());
  grown.erase(std::unique(grown.begin(), grown.end()), grown.end());
  return grown;
}

std::vector<int> CellsAround(const WorkingMesh& whole, const CellLists& cells_at,
                             const Place& place) {
  std::vector<int> cells = place.cells;
  for (int layer = 0; layer < kMostLayers; ++layer) cells = WithLayer(whole, cells);
  for (int ring = 0; ring < kMovingRings + kSeenRings; ++ring) {
    cells = WithRing(whole, cells_at, cells);
  }
  return cells;
}

// What an attempt came to.
struct Outcome {
  CellComplex complex;
  PlaceQuality quality;
  bool keeps_to_hull = true;
};

// The place as all attempts find it.
struct OpenPlace {
  const Excerpt& excerpt;
  const std::vector<std::vector<int32_t>>& openings;
  const RepairEffort& repair;
  const std::vector<uint8_t>& fixed;
  const CellComplex closed;
  const PlaceQuality quality;
};

// `was_in_vain`: whether stars were, in the attempt before; then in this one.
absl::StatusOr<CellComplex> Change(const OpenPlace& place, const Attempt& attempt,
                                   const RefillWith& with, bool* was_in_vain) {
  switch (attempt.remedy) {
    case Remedy::kJoint:
    case Remedy::kMove:
      return place.closed;
    case Remedy::kRepair:
      return RepairCells(place.closed, with.hull, place.repair, with.run);
    case Remedy::kRefill:
      break;
  }
  if (attempt.knows_last && *was_in_vain) {
    return absl::AlreadyExistsError("the attempt before came to the same");
  }
  const Opening opening{place.openings[attempt.layers], attempt.first};
  AMHEX_ASSIGN_OR_RETURN(Refilled refilled,
                         RefillOpening(place.closed, with.hull, opening, with.params, with.run));
  *was_in_vain = refilled.first_was_in_vain;
  return std::move(refilled.complex);
}

std::optional<Outcome> Try(const OpenPlace& place, const Attempt& attempt, const RefillWith& with,
                           bool* was_in_vain) {
  if (attempt.remedy == Remedy::kRefill &&
      place.openings[attempt.layers].size() > kMostCellsRefilled) {
    return std::nullopt;
  }
  auto changed = Change(place, attempt, with, was_in_vain);
  if (!changed.ok() || !place.excerpt.TakeBack(&*changed)) return std::nullopt;
  if (std::abs(QualityOfPlace(*changed).volume - place.quality.volume) > kHopelessVolumeChange) {
    return std::nullopt;
  }
  auto placed = PlacePart(*std::move(changed), place.fixed, with.features, with.run,
                          EffortFor(attempt.remedy));
  if (!placed.ok()) return std::nullopt;
  Outcome outcome{*std::move(placed), {}};
  outcome.quality = QualityOfPlace(outcome.complex);
  const double change = outcome.quality.volume - place.quality.volume;
  if (IsBetter(outcome.quality, place.quality) && std::abs(change) > kMaxVolumeChange) {
    outcome.keeps_to_hull =
        StaysNear(with.hull, place.excerpt.complex(), outcome.complex, StopPoll(with.run));
  }
  return outcome;
}

// The best outcome, judged in the order of the attempts, whatever order they end in.
class BestInTurn {
 public:
  explicit BestInTurn(const PlaceQuality& before) : before_(before), least_(before.lack) {}

  void Found(size_t attempt, std::optional<Outcome> outcome) {
    const std::lock_guard lock(mutex_);
    outcomes_[attempt] = std::move(outcome);
    is_found_[attempt] = true;
    while (!is_decided_ && next_ < std::size(kAttempts) && is_found_[next_]) {
      if (outcomes_[next_].has_value()) Judge(*outcomes_[next_]);
      ++next_;
    }
  }
  // Whether no other attempt counts any more.
  bool is_decided() const {
    const std::lock_guard lock(mutex_);
    return is_decided_;
  }
  std::optional<CellComplex> Take() { return std::move(best_); }

 private:
  void Judge(Outcome& outcome) {
    const PlaceQuality& after = outcome.quality;
    if (!IsBetter(after, before_) || after.lack >= least_ || !outcome.keeps_to_hull) return;
    least_ = after.lack;
    best_ = std::move(outcome.complex);
    is_decided_ = after.minimum >= kPoor;
  }

  const PlaceQuality before_;
  double least_;  // lack of the best
  std::optional<CellComplex> best_;
  std::array<std::optional<Outcome>, std::size(kAttempts)> outcomes_;
  std::array<bool, std::size(kAttempts)> is_found_ = {};
  size_t next_ = 0;  // attempt to be judged
  bool is_decided_ = false;
  mutable std::mutex mutex_;
};

// The attempt, and those behind it that know of it.
void TryFrom(size_t first, const OpenPlace& place, const RefillWith& with, BestInTurn* best) {
  bool was_in_vain = false;
  for (size_t i = first; i < std::size(kAttempts); ++i) {
    if (i > first && !kAttempts[i].knows_last) return;
    if (best->is_decided() || with.run.ShouldStop()) return;
    best->Found(i, Try(place, kAttempts[i], with, &was_in_vain));
  }
}

std::optional<CellComplex> BestOf(const OpenPlace& place, const RefillWith& with, TryOrder order) {
  BestInTurn best(place.quality);
  TryFrom(0, place, with, &best);  // quick, and often enough
  std::vector<size_t> others;
  for (size_t i = 1; i < std::size(kAttempts); ++i) {
    if (!kAttempts[i].knows_last) others.push_back(i);
  }
  if (order == TryOrder::kInTurn) {
    for (const size_t first : others) TryFrom(first, place, with, &best);
    return best.Take();
  }
  std::atomic<size_t> next{0};  // begun in their order
  oneapi::tbb::parallel_for(size_t{0}, others.size(),
                            [&](size_t) { TryFrom(others[next++], place, with, &best); });
  return best.Take();
}

}  // namespace

PlaceRefill::PlaceRefill(const WorkingMesh& whole, const CellLists& cells_at, const Place& place)
    : excerpt_(whole, CellsAround(whole, cells_at, place)), openings_(kMostLayers + 1) {
  std::vector<int> opened = place.cells;
  for (int layers = 0; layers <= kMostLayers; ++layers) {
    if (layers > 0) opened = WithLayer(whole, opened);
    for (const int cell : opened) openings_[layers].push_back(excerpt_.CellOf(cell));
  }
  repair_ = {.quality = kWantedOfPlaces,
             .depth = kRepairDepth,
             .beam_width = kRepairBeamWidth,
             .good_quality = kGoodRepair,
             .poor_quality = kPoorRepairCost,
             .only = openings_[0]};
  std::vector<int> moving = opened;
  for (int ring = 0; ring < kMovingRings; ++ring) moving = WithRing(whole, cells_at, moving);
  fixed_.assign(excerpt_.vertices().size(), 0);
  for (const int cell : excerpt_.cells()) {
    if (std::binary_search(moving.begin(), moving.end(), cell)) continue;
    for (const int32_t v : excerpt_.complex().cells[excerpt_.CellOf(cell)]) fixed_[v] = 1;
  }
}

void PlaceRefill::Run(const RefillWith& with, TryOrder order) {
  const OpenPlace place{excerpt_, openings_,         repair_,
                        fixed_,   excerpt_.Closed(), QualityOfPlace(excerpt_.complex())};
  better_ = BestOf(place, with, order);
  if (!better_.has_value() || with.run.ShouldStop()) return;
  auto raised = PlacePart(*better_, fixed_, with.features, with.run, PlacementEffort::kRaise);
  if (raised.ok()) better_ = *std::move(raised);
}

}  // namespace amhex
