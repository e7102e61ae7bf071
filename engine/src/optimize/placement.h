// What the steps of vertex placement share: the complex, its neighbourhoods, the constraints, and
// the rules every move of a vertex obeys.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "absl/status/status.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "optimize/hull_features.h"
#include "optimize/local_cells.h"
#include "optimize/vertex_constraints.h"
#include "optimize/vertex_neighbourhoods.h"

namespace amhex {

struct Placement {
  CellComplex& complex;
  const HullFeatures& features;
  const VertexNeighbourhoods neighbourhoods;
  VertexConstraints constraints;
  CellSurvey survey;  // as of the last step that has ended
};
// Cells must be of Figure 2; `complex` and `features` must outlive the placement. O(n log n).
Placement PreparePlacement(CellComplex& complex, const HullFeatures& features);

// Which vertices a later sweep need not look at, and how far each moved last.
struct SweepMemory {
  std::vector<uint8_t> active;  // [vertex_count]
  std::vector<float> step;      // [vertex_count] next trial step, edge lengths
};
SweepMemory StartSweeps(int64_t vertex_count);

// Surveys the cells anew of which a vertex has moved, and activates all their vertices.
void NoteMoves(const std::vector<uint8_t>& moved, Placement& placement, SweepMemory& memory);

// Calls `visit(v)` for every vertex, colour by colour, those of one colour in parallel; `visit` may
// move v and read the cells around it. The result does not depend on the thread count. Ends early
// with the reason when the run is to stop.
absl::Status VisitByColour(const VertexNeighbourhoods& neighbourhoods, const RunContext& run,
                           const std::function<void(int32_t)>& visit);

// Least agreement (cosine) between the corner normals of the hull faces at `vertex`, were it at
// `position`, and the hull's normals there; 1 without hull faces.
double WorstNormalAgreement(const Placement& placement, int32_t vertex, const Vec3d& position);

// Judges moves of one vertex. A move may not let any incident cell's scaled Jacobian fall below
// both what the worst one had and `floor`, nor fold a cell, nor turn a hull face away from the
// hull.
class MoveJudge {
 public:
  MoveJudge(const Placement& placement, int32_t vertex, const CornerPenalty& penalty,
            const std::vector<uint8_t>& near_folding);

  const LocalScore& score() const { return score_; }  // where the vertex is now
  LocalCells& cells() { return cells_; }

  // Scaled Jacobians at `position`; leaves the trial there.
  LocalScore Try(const Vec3d& position);
  // May the vertex stay at the position last tried, which scored `trial`?
  bool Permits(const LocalScore& trial, double floor);

 private:
  // True if no hull face at the vertex sags by more than it may, or than it did before.
  bool SagIsPermitted(const Vec3d& position);
  // How far the middle of the i-th hull face at the vertex was from the hull before.
  double SagBefore(int64_t i);

  const Placement& placement_;
  int32_t vertex_;
  Vec3d start_;
  LocalCells cells_;
  LocalScore score_;
  absl::InlinedVector<double, 8> sag_before_;  // by hull face at the vertex; < 0: not known yet
};

}  // namespace amhex
