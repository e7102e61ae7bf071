// Which cells of the grid lie inside: an octree from the whole box down, that asks the hull once
// per octant and descends only where the hull may cut it.
#include <oneapi/tbb/parallel_sort.h>

#include <cmath>
#include <cstdint>

#include "fields/background_grid.h"
#include "input/hull_queries.h"

namespace amhex::fields {
namespace {

enum class Octant : uint8_t { kOutside, kInside, kMixed };

// Below this share of the octant's half diagonal beyond which it is uniform; rounding only.
constexpr double kReachSlack = 1.000001;

class OctantTest {
 public:
  OctantTest(const HullQueries& queries, const Vec3d& origin, double spacing)
      : queries_(queries), origin_(origin), spacing_(spacing) {}

  // `level` 0 = single cells, whose centres decide.
  Octant Classify(uint64_t key, int level) const {
    const double side = std::ldexp(spacing_, level);
    const std::array<int32_t, 3> cell = CellOfKey(key);
    const Vec3d centre = origin_ + Vec3d{cell[0] + 0.5, cell[1] + 0.5, cell[2] + 0.5} * side;
    if (level > 0) {
      const double reach = side * std::sqrt(3.0) / 2 * kReachSlack;
      if (queries_.IsWithin(centre, reach)) return Octant::kMixed;
    }
    return queries_.IsInside(centre) ? Octant::kInside : Octant::kOutside;
  }

 private:
  const HullQueries& queries_;
  Vec3d origin_;
  double spacing_;
};

void AppendCells(uint64_t key, int level, std::vector<uint64_t>* cells) {
  const uint64_t first = key << 3 * level;
  const uint64_t count = uint64_t{1} << 3 * level;
  for (uint64_t k = 0; k < count; ++k) cells->push_back(first + k);
}

}  // namespace

absl::StatusOr<std::vector<uint64_t>> FindInsideCells(const Hull& hull, const Vec3d& origin,
                                                      double spacing, int depth,
                                                      const RunContext& run) {
  const OctantTest test(*hull.queries, origin, spacing);
  std::vector<uint64_t> cells;
  std::vector<uint64_t> octants{0};
  for (int level = depth; level >= 0; --level) {
    std::vector<Octant> kind(octants.size(), Octant::kOutside);
    ForEach(run, static_cast<int64_t>(octants.size()),
            [&](int64_t i) { kind[i] = test.Classify(octants[i], level); });
    if (const absl::Status status = run.CheckStop(); !status.ok()) return status;
    std::vector<uint64_t> children;
    for (size_t i = 0; i < octants.size(); ++i) {
      if (kind[i] == Octant::kInside) AppendCells(octants[i], level, &cells);
      if (kind[i] != Octant::kMixed) continue;
      for (uint64_t child = 0; child < 8; ++child) children.push_back(octants[i] << 3 | child);
    }
    octants = std::move(children);
  }
  oneapi::tbb::parallel_sort(cells.begin(), cells.end());
  return cells;
}

}  // namespace amhex::fields
