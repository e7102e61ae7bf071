// How many cells lie between neighbouring nodes, along each axis: a discrete one-form that is made
// closed, so that the lattices of all nodes fit together.
#pragma once

#include <array>
#include <vector>

#include "absl/status/statusor.h"
#include "fields/background_grid.h"
#include "fields/form_bodies.h"
#include "fields/link_copies.h"
#include "fields/orientation_field.h"

namespace amhex::fields {

struct LatticeSettings {
  // K of the curl against the corrections. Curl that is spread over more than about sqrt(K) nodes
  // stays, and a whole unit of it around a part of the solid is one dislocation there.
  double closure_weight = 3000;
  // Of the corrections along the hull (hull_edges.h) against the others': what layers drift against
  // the hull ends in dislocations as well.
  double hull_edge_weight = 300;
  int max_iterations = 1000;
  double tolerance = 3e-4;
  double density = 1.0;         // wanted cells per edge length cubed
  DeviceUse* device = nullptr;  // where it is solved; null: on the CPU
  LinkCopies* links = nullptr;  // of the same grid and codes; null: made for this solve
};

// [node_count][d]: cells between the node and its neighbour d, along the node's axes.
using Increments = std::vector<std::array<Vec3f, 3>>;

struct LatticeForm {
  // [node_count][d]: cells from the node to its neighbour d (+x, +y, +z of the grid), along the
  // node's own axes; zero without a neighbour.
  Increments increments;
  // [node_count] steps[a] = the way in space of one cell along axis a (columns of the inverse
  // Jacobian), edge lengths. Almost orthogonal.
  std::vector<CellSteps> steps;
  std::vector<Quaternion> frames;  // [node_count] rotation nearest to the steps
  std::vector<Vec3d> sizes;        // [node_count] lengths of the steps, clamped to [0.5, 2]
};

FormView ViewOf(LatticeForm& form);

// The same form of another density.
LatticeForm Denser(const LatticeForm& form, double density, const RunContext& run);

// Grid square (node; +d, +(d + 1) % 3): its corners all exist and no frame singularity runs
// through it, so that a closed form sums to zero around it.
bool IsRegularSquare(const GridLevel& level, const ForwardCodes& codes, int64_t node, int d);

// Increments once around that square, as seen from `node`; zero for a closed form.
Vec3f CurlAround(const GridLevel& level, const ForwardCodes& codes, const Increments& increments,
                 int64_t node, int d);

// Smallest corrections of the increments of `frames` and `sizes` that close them around every
// regular square: min W |e|^2 + K |curl(increments + e)|^2.
absl::StatusOr<Increments> CloseIncrements(const BackgroundGrid& grid,
                                           const std::vector<Quaternion>& frames,
                                           const std::vector<Vec3d>& sizes,
                                           const ForwardCodes& codes,
                                           const LatticeSettings& settings,
                                           const ProgressSlice& slice);

// With the frames and sizes that follow from closed increments, where these tell them and the
// expected ones elsewhere, rescaled to the density of the settings.
LatticeForm FormOf(const BackgroundGrid& grid, const std::vector<Quaternion>& frames,
                   const std::vector<Vec3d>& sizes, const ForwardCodes& codes,
                   Increments increments, double density, const RunContext& run);

// Both.
absl::StatusOr<LatticeForm> SolveLatticeForm(const BackgroundGrid& grid,
                                             const std::vector<Quaternion>& frames,
                                             const std::vector<Vec3d>& sizes,
                                             const ForwardCodes& codes,
                                             const LatticeSettings& settings,
                                             const ProgressSlice& slice);

}  // namespace amhex::fields
