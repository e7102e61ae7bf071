#include "fields/lattice_jacobian.h"

#include "fields/form_bodies.h"
#include "fields/node_links.h"

namespace amhex::fields {

void RecoverFrames(const BackgroundGrid& grid, const ForwardCodes& codes, double density,
                   const RunContext& run, LatticeForm* form) {
  const int64_t count = grid.count();
  const OwnedLinks links(grid.fine(), codes, run);
  const std::vector<Quaternion> frames = form->frames;
  const std::vector<Vec3d> sizes = form->sizes;
  const ExpectedView expected{{frames.data(), count}, {sizes.data(), count}, grid.spacing};
  form->steps.resize(count);
  const FormView view = ViewOf(*form);
  ForEach(run, count, FindStepsBody{links.View(), expected, ReadOnly(view.increments), view.steps});
  std::vector<double> partial(SumBlocks(count), 0.0);
  const ArrayView<double> sums{partial.data(), SumBlocks(count)};
  ForEach(run, sums.size, SumDensityBody{ReadOnly(view.steps), sums});
  const double scale = RefinementFor(density, ReadOnly(sums), count);
  ForEach(run, count, RecoverBody{expected, scale, view});
  ForEach(run, view.increments.size, ScaleIncrementsBody{scale, view.increments});
}

}  // namespace amhex::fields
