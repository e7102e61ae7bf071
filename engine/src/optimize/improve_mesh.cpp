#include "optimize/improve_mesh.h"

#include <utility>

#include "base/status_macros.h"
#include "closure/improve_closure.h"
#include "optimize/place_vertices.h"

namespace amhex {
namespace {

// Each round asks for a little more and looks a little farther.
struct ImprovementRound {
  double quality;  // cells below this scaled Jacobian are replaced
  int depth;       // neighbours absorbed at most
};
constexpr ImprovementRound kRounds[] = {{0.20, 5}, {0.23, 6}, {0.26, 7}};

}  // namespace

absl::StatusOr<CellComplex> ImproveMesh(CellComplex complex, const Hull& hull,
                                        const MeshingParams& params, RunContext& run) {
  AMHEX_ASSIGN_OR_RETURN(complex, PlaceVertices(std::move(complex), hull, params, run));
  for (const ImprovementRound& round : kRounds) {
    AMHEX_ASSIGN_OR_RETURN(complex, ImproveClosure(complex, hull, round.quality, round.depth, run));
    AMHEX_ASSIGN_OR_RETURN(complex, PlaceVertices(std::move(complex), hull, params, run));
  }
  return complex;
}

}  // namespace amhex
