#include "closure/peel_stars.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "assembly/new_cells.h"
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

// The star taken apart; nothing where that gains nothing. Looks at nothing but the star's cells,
// their vertices and who owns faces and edges between those.
std::optional<StarPeeler> PeeledStar(const WorkingMesh& mesh, int32_t apex,
                                     const std::vector<int>& star, StarFolds folds) {
  std::optional<StarPeeler> best;
  if (!IsAtHull(mesh, apex, star)) {
    best.emplace(mesh, SurfaceOf(mesh, apex, star), mesh.vertices()[apex], folds);
    if (!best->Run()) best.reset();
  }
  std::optional<StarPeeler> recapped =
      RecapStar(mesh, apex, star, folds, best ? best->Loss() : LossOf(mesh, star));
  if (recapped) best.emplace(*std::move(recapped));
  return best;
}

// Stars one after the other, but each is looked at side by side with the others first: what was
// found then holds as long as no cell at its vertices has changed.
class StarsInTurn {
 public:
  StarsInTurn(const CellComplex& complex, StarFolds folds, const CellComplex& peeled,
              const StopPoll& poll)
      : folds_(folds),
        poll_(poll),
        mesh_(complex, poll),
        cells_at_(mesh_.CellsAtVertices(poll)),
        is_new_(VerticesOfNewCells(complex, peeled, poll)),
        has_changed_(cells_at_.size(), 0) {}

  CellComplex Run() {
    std::vector<int32_t> apexes;
    for (int32_t v = 0; v < static_cast<int32_t>(cells_at_.size()); ++v) {
      poll_.At(v);
      if (IsApex(mesh_, cells_at_[v]) && IsMarked(cells_at_[v], is_new_)) apexes.push_back(v);
    }
    std::vector<std::optional<StarPeeler>> peeled(apexes.size());
    oneapi::tbb::parallel_for(size_t{0}, apexes.size(), [&](size_t i) {
      poll_.Now();
      peeled[i] = PeeledStar(mesh_, apexes[i], cells_at_[apexes[i]], folds_);
    });
    for (size_t i = 0; i < apexes.size(); ++i) {
      poll_.Now();
      if (!IsMarked(cells_at_[apexes[i]], has_changed_)) {
        Put(cells_at_[apexes[i]], peeled[i]);
      } else if (IsApex(mesh_, cells_at_[apexes[i]])) {
        Put(cells_at_[apexes[i]], PeeledStar(mesh_, apexes[i], cells_at_[apexes[i]], folds_));
      }
    }
    return mesh_.ToComplex(poll_);
  }

 private:
  template <class Visit>
  void VisitVertices(const std::vector<int>& star, const Visit& visit) const {
    for (const int cell : star) {
      for (const int32_t v : VerticesOf(mesh_.corners(cell))) visit(v);
    }
  }

  bool IsMarked(const std::vector<int>& star, const std::vector<uint8_t>& marks) const {
    bool any = false;
    VisitVertices(star, [&](int32_t v) { any = any || marks[v] != 0; });
    return any;
  }

  void Put(const std::vector<int>& star, const std::optional<StarPeeler>& peeled) {
    if (!peeled) return;
    VisitVertices(star, [&](int32_t v) { has_changed_[v] = 1; });
    peeled->Apply(&mesh_);
  }

  const StarFolds folds_;
  const StopPoll& poll_;
  WorkingMesh mesh_;
  const std::vector<std::vector<int>> cells_at_;  // [vertex] of the start
  const std::vector<uint8_t> is_new_;             // [vertex] there is a star that was not looked at
  std::vector<uint8_t> has_changed_;              // [vertex] cells at it came or went
};

}  // namespace

absl::StatusOr<CellComplex> PeelStars(const CellComplex& complex, StarFolds folds,
                                      const RunContext& run, const CellComplex& peeled) {
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  const StopPoll poll(run);
  return StarsInTurn(complex, folds, peeled, poll).Run();
}

}  // namespace amhex
