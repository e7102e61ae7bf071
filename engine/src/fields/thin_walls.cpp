#include "fields/thin_walls.h"

#include <cstdint>
#include <vector>

#include "base/status_macros.h"
#include "fields/wall_question.h"

namespace amhex::fields {
namespace {

template <class T>
ArrayView<const T> ViewOf(const std::vector<T>& values) {
  return {values.data(), static_cast<int64_t>(values.size())};
}

// [constraint] as WallLoweringOf.
absl::StatusOr<std::vector<Vec3d>> FindLowerings(const HullAsker& hull, const BackgroundGrid& grid,
                                                 const LatticeForm& form, const RunContext& run) {
  const GridLevel& level = grid.fine();
  std::vector<Quaternion> frames(level.constraints.size());
  std::vector<Vec3d> sizes(level.constraints.size());
  ForEach(run, grid.count(), [&](int64_t i) {
    const int32_t k = level.constraint_of_node[i];
    if (k >= 0) frames[k] = form.frames[i], sizes[k] = form.sizes[i];
  });
  std::vector<int32_t> first{0};
  std::vector<HullConstraint> constraints;  // one after the other: most nodes have one of three
  for (const HullConstraints& of_node : level.constraints) {
    constraints.insert(constraints.end(), of_node.begin(), of_node.end());
    first.push_back(static_cast<int32_t>(constraints.size()));
  }
  return hull.Ask(WallLoweringOf{
      {ViewOf(first), ViewOf(constraints), ViewOf(frames), ViewOf(sizes)}, grid.spacing});
}

}  // namespace

absl::Status FitThinWalls(const HullAsker& hull, const BackgroundGrid& grid,
                          const ForwardCodes& codes, const RunContext& run, LatticeForm* form) {
  AMHEX_ASSIGN_OR_RETURN(const std::vector<Vec3d> lowerings, FindLowerings(hull, grid, *form, run));
  const auto lowering = [&](int64_t i) {
    const int32_t k = grid.fine().constraint_of_node[i];
    return k < 0 ? Vec3d{1, 1, 1} : lowerings[k];
  };
  ForEach(run, grid.count(), [&](int64_t i) {
    const Vec3d here = lowering(i);
    for (int d = 0; d < 3; ++d) {
      const int32_t j = grid.fine().neighbours[i][d];
      if (j < 0) continue;
      const AxisRotation& rotation = kAxisRotations[codes[i][d]];
      const Vec3d there = lowering(j);
      for (int a = 0; a < 3; ++a) {
        const double mean = (here[a] + there[rotation.source[a]]) / 2;
        form->increments[i][d][a] *= static_cast<float>(mean);
      }
    }
    for (int a = 0; a < 3; ++a) {
      form->steps[i][a] /= here[a];
      form->sizes[i][a] /= here[a];
    }
  });
  return run.CheckStop();
}

}  // namespace amhex::fields
