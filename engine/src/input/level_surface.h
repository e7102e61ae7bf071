// A closed surface where a field changes its sign, sharp edges included.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"
#include "amhex/run_context.h"

namespace amhex {

using EightPoints = std::array<Vec3d, 8>;
using EightValues = std::array<double, 8>;

// A solid known by questions: negative inside. Called from several threads at once.
class SurfaceField {
 public:
  virtual ~SurfaceField() = default;
  // Its sign decides; between points of different sign it is searched for its zero.
  virtual double Value(const Vec3d& p) const = 0;
  // The same for eight points near each other, found together.
  virtual EightValues Values(const EightPoints& p) const;
  // Unit outward normal at a point next to the surface; `spacing` is the grid's.
  virtual Vec3d Normal(const Vec3d& p, double spacing) const = 0;
  // The same answers, found faster within `reach` of `centre`; it must not outlive the field. Null
  // if there is no faster way.
  virtual std::unique_ptr<SurfaceField> Around(const Vec3d& centre, double reach) const;
};

// A regular grid; nodes are numbered from `low`, `node_count` per axis.
struct LevelGrid {
  Vec3d low;
  double spacing = 0;
  std::array<int64_t, 3> node_count{};  // each at least 3
};

// The grid of the wanted spacing that holds `box` and a margin of four cells.
LevelGrid GridAround(const Box3d& box, double spacing);

// Dual contouring (Ju et al. 2002): one vertex per grid cell that the surface crosses, placed where
// the planes met at the cell's edges intersect best, so that sharp edges come out sharp.
//
// The result is always a closed two-manifold: the nodes' signs are first made well-composed
// (Latecki 1997) by turning as few outside nodes as possible to inside, which may close gaps
// thinner than the grid. The grid's outermost nodes count as outside.
//
// The surface is followed from the cells around `seeds`; parts that no seed leads to are not found.
// Evaluates the field only near the surface; time and memory grow with the surface.
// RESOURCE_EXHAUSTED beyond 8 million blocks of 2 x 2 x 2 nodes around the surface.
absl::StatusOr<TriangleMesh> ExtractLevel(const LevelGrid& grid, const SurfaceField& field,
                                          const std::vector<Vec3d>& seeds, RunContext& run);

}  // namespace amhex
