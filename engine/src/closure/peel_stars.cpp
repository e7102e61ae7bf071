#include "closure/peel_stars.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "base/status_macros.h"
#include "closure/recap_star.h"
#include "closure/star_peeler.h"
#include "closure/working_mesh.h"

namespace amhex {
namespace {

bool IsPointed(PrimitiveType type) {
  return type == PrimitiveType::kPyramid || type == PrimitiveType::kTetrahedron;
}

// True if all cells at a vertex are living pyramids and tetrahedra.
bool IsApex(const WorkingMesh& mesh, const std::vector<int>& cells) {
  return !cells.empty() && std::all_of(cells.begin(), cells.end(), [&](int cell) {
    return mesh.alive(cell) && IsPointed(mesh.type(cell));
  });
}

void PeelStar(int32_t apex, const std::vector<int>& star, StarFolds folds, WorkingMesh* mesh) {
  std::optional<StarPeeler> best;
  if (!IsAtHull(*mesh, apex, star)) {
    best.emplace(*mesh, SurfaceOf(*mesh, apex, star), mesh->vertices()[apex], folds);
    if (!best->Run()) best.reset();
  }
  std::optional<StarPeeler> recapped =
      RecapStar(*mesh, apex, star, folds, best ? best->Loss() : LossOf(*mesh, star));
  if (recapped) best.emplace(*std::move(recapped));
  if (best) best->Apply(mesh);
}

}  // namespace

absl::StatusOr<CellComplex> PeelStars(const CellComplex& complex, StarFolds folds,
                                      const RunContext& run) {
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  const StopPoll poll(run);
  WorkingMesh mesh(complex, poll);
  const auto cells_at = mesh.CellsAtVertices(poll);
  for (int32_t v = 0; v < static_cast<int32_t>(cells_at.size()); ++v) {
    poll.At(v);
    if (!IsApex(mesh, cells_at[v])) continue;
    if (absl::Status status = run.CheckStop(); !status.ok()) return status;
    PeelStar(v, cells_at[v], folds, &mesh);
  }
  return mesh.ToComplex(poll);
}

}  // namespace amhex
