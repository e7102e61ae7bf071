#include "fields/field_sites.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "base/array_view_of.h"
#include "base/status_macros.h"
#include "cuda/device_use.h"
#include "fields/background_grid.h"
#include "fields/face_links.h"
#include "fields/lattice_form.h"
#include "fields/lattice_task.h"
#include "fields/link_copies.h"
#include "fields/node_links.h"
#include "fields/orientation_field.h"
#include "fields/phase_field.h"
#include "fields/site_clusters.h"
#include "fields/size_field.h"
#include "fields/thin_walls.h"
#include "fields/whole_lattice.h"
#include "input/wanted_cells.h"

namespace amhex {
namespace {

// Closing adds cells: fewer sites than wanted cells bring the final count near the wish.
// (Measured: sites come out 1 to 2 % below the density asked for, next to the hull mostly.)
constexpr double kSitesPerWantedCell = 0.985;

// Cells that each trial asks for, as shares of the wanted number: whether a lattice fits between
// the sides of a solid is a matter of a few percent. The background grid's own density turns the
// lattice's singularities over as well; trials in a row that have it in common share its frames and
// sizes, and the form as well if they follow the hull alike.
//
// Layers that follow the hull firmly have fewer dislocations, but between sides that are not
// parallel their cells become thin towards the edge: there some layers should end. So trials differ
// in this, too: of the first two, which most solids of thousands of cells start, one follows
// firmly.
struct TrialRecipe {
  double grid;
  double sites;
  double hull_edge_weight;  // of LatticeSettings
  double closure_weight = fields::LatticeSettings().closure_weight;
  // Of OrientationSettings:
  double hull_weight = fields::OrientationSettings().hull_weight;
  double normal_fading = 0;

  // What a form depends on besides its grid, frames and sizes.
  std::pair<double, double> Weights() const { return {hull_edge_weight, closure_weight}; }
  bool SharesFrames(const TrialRecipe& other) const {
    return grid == other.grid && hull_weight == other.hull_weight &&
           normal_fading == other.normal_fading;
  }
};
constexpr double kFirmly = fields::LatticeSettings().hull_edge_weight;
constexpr double kLightly = 30;

// How far the hull's normals should reach into a solid, and how firmly its lattice should be
// closed, differs from solid to solid: against the first recipe, these weights leave a fifth fewer
// faces open in a hand or a coarse bunny and a sixth more in a fine bunny (docs/results.md). Large
// solids try them at first, others as the third and fourth.
constexpr TrialRecipe WithFadingNormals(double grid, double sites, double hull_edge_weight) {
  return {grid, sites, hull_edge_weight, 600, 100, 0.7};
}
constexpr std::array<TrialRecipe, kMaxTrials> kTrialRecipes = {
    {{1.0, 1.0, kLightly},
     {1.0, 0.97, kFirmly},
     WithFadingNormals(1.0, 0.97, kFirmly),
     WithFadingNormals(1.03, 0.97, kLightly),
     {1.0, 1.03, kLightly},
     {1.0, 0.97, kLightly},
     {1.06, 1.06, kLightly},
     {1.06, 1.03, kLightly},
     {0.94, 0.94, kLightly},
     {1.03, 1.03, kLightly},
     {1.03, 1.015, kLightly},
     {0.91, 0.91, kFirmly}}};
constexpr TrialRecipe kOfLarge = WithFadingNormals(1.0, 1.0, kLightly);

const TrialRecipe& RecipeOf(int trial, const Hull& hull) {
  if (hull.volume <= kLargeSolid || trial > 1) return kTrialRecipes[static_cast<size_t>(trial)];
  return trial == 0 ? kOfLarge : kTrialRecipes[0];
}

// Of a lattice that ends the trials, from the wanted number of cells.
constexpr double kMostDeviation = 0.12;
// Of few trials one that is hardly torn is the last as well: of 62 solids of 5,000 to 15,000 cells
// six have no larger share of torn sites, and the second lattice was taken for none of them; of the
// next six, up to 0.9 %, for four, two of them for the better.
constexpr double kHardlyTorn = 0.0055;
// And a third one, which has frames of its own, is made where both others have more torn sites: of
// 25 such solids of 5,000 to 15,000 cells 15 have the mesh from it, with two points more of
// hexahedra in the mean. Below that a third of them would be expected to gain a tenth as much.
constexpr double kTorn = 0.028;
// Of large solids the second one where the first is torn so: thin walls and struts all over, where
// it has five to sixteen points more of hexahedra. Other shapes of 30,000 cells stay below this.
constexpr double kLargeTorn = 0.035;

// Ends of the steps on the stage's progress bar, by their measured cost.
constexpr double kGridDone = 0.45;  // of the grid's fields
constexpr double kOrientationDone = 0.75;
constexpr double kSizeDone = 0.55;  // of a trial
constexpr double kLatticeDone = 0.7;
constexpr double kPhaseDone = 0.7;  // of what comes after

// What trials of one grid share.
struct GridFields {
  fields::BackgroundGrid grid;
  std::vector<Quaternion> frames;
  std::vector<Vec3d> sizes;
  fields::ForwardCodes codes;
  DeviceUse* device = nullptr;  // where to solve; null = on the CPU
  // Of what is there.
  fields::LinkCopies links;
  ResidentSlot frames_there, sizes_there;
};

// What trials of one grid and the same weights share.
struct SharedForm {
  double density = 1;
  fields::Increments closed;
  ResidentSlot closed_there;
  std::optional<fields::LatticeForm> form;  // once somebody asks on the host
};
using SharedForms = std::map<std::pair<double, double>, SharedForm>;  // by weights

// With as many nodes per cell as ever, where the recipe's grid has so many in a cubic edge length.
absl::StatusOr<fields::BackgroundGrid> BuildGrid(const Hull& hull, const TrialRecipe& recipe,
                                                 DeviceUse* device,
                                                 const fields::ProgressSlice& slice) {
  const double spacing = 1.0 / fields::kNodesPerEdge / std::cbrt(recipe.grid);
  return fields::BuildBackgroundGrid(hull, spacing, slice.Part(0, kGridDone), device);
}

// Only the orientation field needs the grid's coarser levels: they are gone where no other will be
// solved on it.
enum class CoarserLevels : uint8_t { kGone, kKept };

absl::StatusOr<GridFields> SolveGridFields(fields::BackgroundGrid grid, CoarserLevels coarser,
                                           const HullSamples& samples, const TrialRecipe& recipe,
                                           DeviceUse* device, const fields::ProgressSlice& slice) {
  using namespace fields;  // NOLINT: the steps below are all from there
  GridFields result;
  result.device = device;
  result.grid = std::move(grid);
  OrientationSettings orientation_settings;
  orientation_settings.hull_weight = recipe.hull_weight;
  orientation_settings.normal_fading = recipe.normal_fading;
  orientation_settings.device = device;
  orientation_settings.frames_there = &result.frames_there;
  AMHEX_ASSIGN_OR_RETURN(OrientationField orientation,
                         SolveOrientationField(result.grid, samples, orientation_settings,
                                               slice.Part(kGridDone, kOrientationDone)));
  result.frames = std::move(orientation.frames), result.codes = std::move(orientation.codes);
  if (coarser == CoarserLevels::kGone) result.grid.levels.resize(1);
  SizeSettings size_settings;
  size_settings.device = device;
  size_settings.links = &result.links;
  AMHEX_ASSIGN_OR_RETURN(result.sizes,
                         SolveSizeField(result.grid, result.frames, result.codes, size_settings,
                                        slice.Part(kOrientationDone, 1)));
  return result;
}

absl::StatusOr<SharedForm> SolveForm(GridFields& solved, const TrialRecipe& recipe,
                                     const fields::ProgressSlice& slice) {
  fields::LatticeSettings settings;
  settings.density = kSitesPerWantedCell * recipe.grid;
  settings.hull_edge_weight = recipe.hull_edge_weight;
  settings.closure_weight = recipe.closure_weight;
  settings.device = solved.device;
  settings.links = &solved.links;
  auto closed = fields::CloseIncrements(solved.grid, solved.frames, solved.sizes, solved.codes,
                                        settings, slice);
  solved.links.of_slots.reset();  // another form is rarely asked for, and the phases need the room
  if (!closed.ok()) return closed.status();
  return SharedForm{settings.density, *std::move(closed), {}, {}};
}

// A trial on the host.
absl::StatusOr<Sites> SitesOnCpu(const Hull& hull, const GridFields& solved, SharedForm& shared,
                                 double denser, const fields::ProgressSlice& slice) {
  using namespace fields;  // NOLINT: the steps below are all from there
  RunContext& run = slice.run();
  if (!shared.form.has_value()) {
    // A device may be asked for the next trial.
    Increments closed =
        solved.device == nullptr ? std::move(shared.closed) : Increments(shared.closed);
    shared.form = FormOf(solved.grid, solved.frames, solved.sizes, solved.codes, std::move(closed),
                         shared.density, run);
  }
  LatticeForm form = Denser(*shared.form, denser, run);
  AMHEX_RETURN_IF_ERROR(FitThinWalls(*hull.queries, solved.grid, solved.codes, run, &form));
  AMHEX_ASSIGN_OR_RETURN(
      const std::vector<Vec3d> positions,
      SolvePhaseField(solved.grid, solved.codes, form, {}, slice.Part(0, kPhaseDone)));
  return ClusterSites(*hull.queries, solved.grid, form, positions, slice.Part(kPhaseDone, 1));
}

Sites SitesOf(const fields::LatticeTask& task) {
  Sites sites;
  for (const fields::LatticeSite& site : task.sites) {
    sites.position.push_back(site.centre);
    sites.frame.push_back(fields::ToFrame(site.frame));
    sites.size.push_back(site.size);
    sites.cell_volume.push_back(0);
  }
  sites.links = fields::LinksOf(task.voted);
  return sites;
}

absl::StatusOr<Sites> SitesOfTrial(const Hull& hull, GridFields& solved, SharedForm& shared,
                                   double denser, const fields::ProgressSlice& slice) {
  using namespace fields;  // NOLINT: the steps below are all from there
  if (solved.device == nullptr) return SitesOnCpu(hull, solved, shared, denser, slice);
  const RunContext& run = slice.run();
  const OwnedLinks links(solved.grid.fine(), solved.codes, run);
  LatticeTask task;
  task.nodes = solved.grid.Cells();
  task.links = links.View(), task.links_there = &solved.links.of_nodes;
  task.rotations = {kAxisRotations.data(), kRotationCount};
  task.expected = {ArrayViewOf(solved.frames), ArrayViewOf(solved.sizes), solved.grid.spacing};
  task.form_there = {&solved.frames_there, &solved.sizes_there, &shared.closed_there};
  task.at_hull = solved.grid.fine().at_hull.View();
  task.closed = {&shared.closed.data()->data()->x, kIncrements * solved.grid.count()};
  task.density = shared.density, task.denser = denser;
  task.course = CourseOf({}, slice.Part(0, kPhaseDone));
  task.hull = hull.queries->view_if_here(), task.resident = &hull.queries->resident();
  task.should_stop = [&run] { return run.ShouldStop(); };
  std::optional<Sites> on_host;
  const auto on_cpu = [&]() -> absl::StatusOr<bool> {
    AMHEX_ASSIGN_OR_RETURN(on_host, SitesOnCpu(hull, solved, shared, denser, slice));
    return true;
  };
  AMHEX_RETURN_IF_ERROR(solved.device->Run(&task, on_cpu).status());
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  slice.Report(1.0);
  return on_host.has_value() ? *std::move(on_host) : SitesOf(task);
}

// Whether the next frames after a trial's are solved on the same grid.
CoarserLevels LevelsAfter(int trial, int count, const Hull& hull) {
  const TrialRecipe& recipe = RecipeOf(trial, hull);
  for (int next = trial + 1; next < count; ++next) {
    const TrialRecipe& other = RecipeOf(next, hull);
    if (other.SharesFrames(recipe)) continue;
    return other.grid == recipe.grid ? CoarserLevels::kKept : CoarserLevels::kGone;
  }
  return CoarserLevels::kGone;
}

// No other lattice would be better than one that fits and has about as many cells as are wanted.
bool IsEnough(const Sites& sites, int trial_count, const Hull& hull, const HullSamples& samples,
              const RunContext& run) {
  const StopPoll poll(run);
  const bool is_hardly_torn =
      trial_count <= kFewTrials && fields::ShareOfTornSites(sites) <= kHardlyTorn;
  if (!is_hardly_torn && !fields::IsWholeLattice(sites, samples, poll)) return false;
  const double deviation = static_cast<double>(sites.count()) / WantedCells(hull, poll) - 1;
  return std::abs(deviation) < kMostDeviation;
}

// Whether a further one is worth its frames, where few are tried.
bool AreTorn(const std::vector<Sites>& trials, const Hull& hull) {
  const double torn = hull.volume > kLargeSolid ? kLargeTorn : kTorn;
  return std::all_of(trials.begin(), trials.end(),
                     [torn](const Sites& sites) { return fields::ShareOfTornSites(sites) > torn; });
}

// Those from `first` on, below `counts.most`.
absl::StatusOr<std::vector<Sites>> PopulateTrials(const Hull& hull, const HullSamples& samples,
                                                  int first, const TrialCount& counts,
                                                  Backend backend, RunContext& run) {
  const int count = counts.most;
  AMHEX_ASSIGN_OR_RETURN(DeviceUse choice, DeviceUse::Choose(backend));
  DeviceUse* const device = choice.uses_device() ? &choice : nullptr;
  std::vector<Sites> trials;
  std::optional<GridFields> solved;
  SharedForms forms;  // of that grid
  for (int trial = first; trial < count; ++trial) {
    const TrialRecipe& recipe = RecipeOf(trial, hull);
    const fields::ProgressSlice slice(run, static_cast<double>(trial - first) / (count - first),
                                      (trial - first + 1.0) / (count - first));
    if (trial == first || !recipe.SharesFrames(RecipeOf(trial - 1, hull))) {
      forms.clear();  // before the next takes memory
      std::optional<fields::BackgroundGrid> grid;
      if (trial > first && recipe.grid == RecipeOf(trial - 1, hull).grid) {
        grid = std::move(solved->grid);
      }
      solved.reset();
      const fields::ProgressSlice of_grid = slice.Part(0, kSizeDone);
      if (!grid.has_value()) {
        AMHEX_ASSIGN_OR_RETURN(grid, BuildGrid(hull, recipe, device, of_grid));
      }
      AMHEX_ASSIGN_OR_RETURN(
          solved, SolveGridFields(*std::move(grid), LevelsAfter(trial, count, hull), samples,
                                  recipe, device, of_grid));
    }
    auto form = forms.find(recipe.Weights());
    if (form == forms.end()) {
      // The solve needs the room.
      solved->sizes_there.reset();
      for (auto& [weights, other] : forms) other.closed_there.reset();
      AMHEX_ASSIGN_OR_RETURN(SharedForm closed,
                             SolveForm(*solved, recipe, slice.Part(kSizeDone, kLatticeDone)));
      form = forms.emplace(recipe.Weights(), std::move(closed)).first;
    }
    absl::StatusOr<Sites> sites = SitesOfTrial(
        hull, *solved, form->second, recipe.sites / recipe.grid, slice.Part(kLatticeDone, 1));
    if (absl::Status stopped = run.CheckStop(); !stopped.ok()) return stopped;
    if (sites.ok()) {
      trials.push_back(*std::move(sites));
      if (trial + 1 < count && IsEnough(trials.back(), count, hull, samples, run)) {
        trials.erase(trials.begin(), trials.end() - 1);
        break;
      }
      if (trial + 1 < count && trial + 1 >= counts.usual && !AreTorn(trials, hull)) break;
    } else if (trial == first) {
      return sites.status();  // what fails as asked for is the user's to know
    }
  }
  fields::ProgressSlice(run, 0, 1).Report(1.0);
  for (Sites& sites : trials) sites.device_notes = choice.notes();
  return trials;
}

}  // namespace

absl::StatusOr<std::vector<Sites>> PopulateFromFields(const Hull& hull, const HullSamples& samples,
                                                      const TrialCount& count, Backend backend,
                                                      RunContext& run) {
  return PopulateTrials(hull, samples, 0, {count.usual, std::min(count.most, kMaxTrials)}, backend,
                        run);
}

absl::StatusOr<Sites> PopulateTrial(const Hull& hull, const HullSamples& samples, int trial,
                                    Backend backend, RunContext& run) {
  AMHEX_ASSIGN_OR_RETURN(std::vector<Sites> only,
                         PopulateTrials(hull, samples, trial, {1, trial + 1}, backend, run));
  return std::move(only.front());
}

}  // namespace amhex
