#include "fields/lattice_form.h"

#include <cmath>
#include <optional>
#include <utility>

#include "fields/closure_system.h"
#include "fields/conjugate_gradient.h"
#include "fields/hull_edges.h"
#include "fields/lattice_jacobian.h"
#include "fields/node_slots.h"

namespace amhex::fields {
namespace {

// Cells along the node's axes per step `d` of the grid.
Vec3d OwnIncrement(const Quaternion& frame, const Vec3d& size, int d, double spacing) {
  const AxisFrame axes = ToFrame(frame);
  return {axes.axis[0][d] * spacing / size.x, axes.axis[1][d] * spacing / size.y,
          axes.axis[2][d] * spacing / size.z};
}

// Mean of what the two ends of each edge expect.
Increments ExpectedIncrements(const BackgroundGrid& grid, const std::vector<Quaternion>& frames,
                              const std::vector<Vec3d>& sizes, const ForwardCodes& codes,
                              const RunContext& run) {
  Increments increments(grid.count());
  ForEach(run, grid.count(), [&](int64_t i) {
    for (int d = 0; d < 3; ++d) {
      const int32_t j = grid.fine().neighbours[i][d];
      if (j < 0) continue;
      const Vec3d here = OwnIncrement(frames[i], sizes[i], d, grid.spacing);
      const Vec3d there =
          kAxisRotations[codes[i][d]].Apply(OwnIncrement(frames[j], sizes[j], d, grid.spacing));
      const Vec3d mean = (here + there) * 0.5;
      increments[i][d] = {static_cast<float>(mean.x), static_cast<float>(mean.y),
                          static_cast<float>(mean.z)};
    }
  });
  return increments;
}

// Into `flat`, in slots, where `value(node, d)` is known.
template <class Value>
void Flatten(const NodeSlots& slots, const RunContext& run, const Value& value,
             std::vector<float>* flat) {
  ForEach(run, slots.node_count(), [&](int64_t i) {
    for (int d = 0; d < 3; ++d) {
      const Vec3f v = value(i, d);
      for (int a = 0; a < 3; ++a) (*flat)[ClosureSystem::Place(slots.SlotOf(i), d, a)] = v[a];
    }
  });
}

absl::Status Correct(const ClosureSystem& closure, const LatticeSettings& settings,
                     const RunContext& run, Increments* increments) {
  const NodeSlots& slots = closure.slots();
  const int64_t size = ClosureOperator::kUnknowns * slots.count();
  std::vector<float> rhs(size, 0.0F), correction, curl_lanes(size, 0.0F);
  LinearSystem system;
  system.unknowns = ClosureOperator::kUnknowns;
  system.passes = ClosureOperator::kPasses;
  system.inverse_diagonal = [&] {
    std::vector<float> inverse(size, 1.0F);
    Flatten(
        slots, run,
        [&](int64_t i, int d) {
          const Vec3f diagonal = closure.DiagonalAt(i, d);
          return Vec3f{1 / diagonal.x, 1 / diagonal.y, 1 / diagonal.z};
        },
        &inverse);
    return inverse;
  };
  Increments curls(increments->size());
  closure.Curls(*increments, &curls);
  const auto weight = static_cast<float>(settings.closure_weight);
  Flatten(
      slots, run, [&](int64_t i, int d) { return closure.Adjoint(curls, i, d) * -weight; }, &rhs);
  system.apply = [&](int pass, int64_t begin, int64_t end, const float* x, float* product) {
    if (pass == 0) {
      closure.ApplyCurl(begin, end, x, curl_lanes.data());
    } else {
      closure.ApplyAdjoint(begin, end, {x, curl_lanes.data(), product});
    }
  };
  std::optional<SlotLinks> links;
  if (settings.device != nullptr) {
    system.device = settings.device;
    if (settings.links != nullptr) system.links = &settings.links->of_slots;
    system.matrix = closure.Matrix(links.emplace(closure.Links()).View());
  }
  const absl::StatusOr<int> iterations = SolveConjugateGradient(
      system, rhs, {settings.max_iterations, settings.tolerance}, run, &correction);
  if (!iterations.ok()) return iterations.status();
  ForEach(run, slots.node_count(), [&](int64_t i) {
    for (int d = 0; d < 3; ++d) {
      for (int a = 0; a < 3; ++a) {
        (*increments)[i][d][a] += correction[ClosureSystem::Place(slots.SlotOf(i), d, a)];
      }
    }
  });
  return run.CheckStop();
}

}  // namespace

FormView ViewOf(LatticeForm& form) {
  const auto count = static_cast<int64_t>(form.increments.size());
  return {{&form.increments.data()->data()->x, kIncrements * count},
          {form.steps.data(), count},
          {form.frames.data(), count},
          {form.sizes.data(), count}};
}

LatticeForm Denser(const LatticeForm& form, double density, const RunContext& run) {
  LatticeForm scaled = form;
  const double scale = std::cbrt(density);
  const FormView view = ViewOf(scaled);
  ForEach(run, view.sizes.size, DenserBody{scale, view});
  ForEach(run, view.increments.size, ScaleIncrementsBody{scale, view.increments});
  return scaled;
}

bool IsRegularSquare(const GridLevel& level, const ForwardCodes& codes, int64_t node, int d) {
  const int e = (d + 1) % 3;
  const int32_t a = level.neighbours[node][d], b = level.neighbours[node][e];
  if (a < 0 || b < 0 || level.neighbours[a][e] < 0) return false;
  return Compose(kAxisRotations[codes[node][d]], kAxisRotations[codes[a][e]]) ==
         Compose(kAxisRotations[codes[node][e]], kAxisRotations[codes[b][d]]);
}

Vec3f CurlAround(const GridLevel& level, const ForwardCodes& codes, const Increments& increments,
                 int64_t node, int d) {
  const int e = (d + 1) % 3;
  const int32_t a = level.neighbours[node][d], b = level.neighbours[node][e];
  return increments[node][d] + kAxisRotations[codes[node][d]].Apply(increments[a][e]) -
         kAxisRotations[codes[node][e]].Apply(increments[b][d]) - increments[node][e];
}

absl::StatusOr<Increments> CloseIncrements(const BackgroundGrid& grid,
                                           const std::vector<Quaternion>& frames,
                                           const std::vector<Vec3d>& sizes,
                                           const ForwardCodes& codes,
                                           const LatticeSettings& settings,
                                           const ProgressSlice& slice) {
  const RunContext& run = slice.run();
  Increments increments = ExpectedIncrements(grid, frames, sizes, codes, run);
  const ClosureSystem closure({grid.fine(), codes, run}, settings,
                              FollowHull({grid, frames, sizes, codes}, run, &increments));
  if (absl::Status s = run.CheckStop(); !s.ok()) return s;
  if (absl::Status s = Correct(closure, settings, run, &increments); !s.ok()) return s;
  slice.Report(0.9);
  return increments;
}

LatticeForm FormOf(const BackgroundGrid& grid, const std::vector<Quaternion>& frames,
                   const std::vector<Vec3d>& sizes, const ForwardCodes& codes,
                   Increments increments, double density, const RunContext& run) {
  LatticeForm form;
  form.increments = std::move(increments);
  form.frames = frames;
  form.sizes = sizes;
  RecoverFrames(grid, codes, density, run, &form);
  return form;
}

absl::StatusOr<LatticeForm> SolveLatticeForm(const BackgroundGrid& grid,
                                             const std::vector<Quaternion>& frames,
                                             const std::vector<Vec3d>& sizes,
                                             const ForwardCodes& codes,
                                             const LatticeSettings& settings,
                                             const ProgressSlice& slice) {
  absl::StatusOr<Increments> closed = CloseIncrements(grid, frames, sizes, codes, settings, slice);
  if (!closed.ok()) return closed.status();
  const RunContext& run = slice.run();
  LatticeForm form = FormOf(grid, frames, sizes, codes, *std::move(closed), settings.density, run);
  if (absl::Status status = run.CheckStop(); !status.ok()) return status;
  slice.Report(1.0);
  return form;
}

}  // namespace amhex::fields
