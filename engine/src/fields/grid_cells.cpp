// Which cells of the grid lie inside: an octree from the whole box down, that asks the hull once
// per octant and descends only where the hull may cut it.
#include <oneapi/tbb/parallel_sort.h>

#include <cmath>
#include <cstdint>

#include "base/status_macros.h"
#include "fields/background_grid.h"

namespace amhex::fields {
namespace {

// Below this share of the octant's half diagonal beyond which it is uniform; rounding only.
constexpr double kReachSlack = 1.000001;

void AppendCells(uint64_t key, int level, std::vector<uint64_t>* cells) {
  const uint64_t first = key << 3 * level;
  const uint64_t count = uint64_t{1} << 3 * level;
  for (uint64_t k = 0; k < count; ++k) cells->push_back(first + k);
}

}  // namespace

absl::StatusOr<std::vector<uint64_t>> FindInsideCells(const HullAsker& hull, const Vec3d& origin,
                                                      double spacing, int depth) {
  std::vector<uint64_t> cells;
  std::vector<uint64_t> octants{0};
  for (int level = depth; level >= 0; --level) {
    const double side = std::ldexp(spacing, level);
    SideOf<CellCentres> question{CentresOf(octants, origin, side)};
    // The hull may pass through an octant it comes near to; the centres of single cells decide.
    if (level > 0) question.near = side * std::sqrt(3.0) / 2 * kReachSlack;
    AMHEX_ASSIGN_OR_RETURN(const std::vector<HullSide> sides, hull.Ask(question));
    std::vector<uint64_t> children;
    for (size_t i = 0; i < octants.size(); ++i) {
      if (sides[i] == HullSide::kInside) AppendCells(octants[i], level, &cells);
      if (sides[i] != HullSide::kNear) continue;
      for (uint64_t child = 0; child < 8; ++child) children.push_back(octants[i] << 3 | child);
    }
    octants = std::move(children);
  }
  oneapi::tbb::parallel_sort(cells.begin(), cells.end());
  return cells;
}

}  // namespace amhex::fields
