#include "fields/thin_walls.h"

#include <cstdint>
#include <vector>

#include "base/array_view_of.h"
#include "base/status_macros.h"
#include "fields/form_bodies.h"
#include "fields/node_links.h"
#include "fields/wall_question.h"
#include "input/hull_batch.h"
#include "input/hull_queries.h"

namespace amhex::fields {

absl::Status FitThinWalls(const HullQueries& hull, const BackgroundGrid& grid,
                          const ForwardCodes& codes, const RunContext& run, LatticeForm* form) {
  const OwnedLinks links(grid.fine(), codes, run);
  const FormView view = ViewOf(*form);
  const WallLoweringOf question{grid.fine().at_hull.View(), ReadOnly(view.frames),
                                ReadOnly(view.sizes), grid.spacing};
  std::vector<Vec3d> lowerings(grid.fine().at_hull.nodes.size());
  const ArrayView<Vec3d> answers{lowerings.data(), question.at_hull.count()};
  ForEach(run, answers.size, AskBody<WallLoweringOf>{hull.view(), question, answers});
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  ForEach(run, grid.count(),
          LowerBody{links.View(), ArrayViewOf(grid.fine().place_at_hull), ReadOnly(answers), view});
  return run.CheckStop();
}

}  // namespace amhex::fields
