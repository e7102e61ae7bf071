// Coarser levels (2 x 2 x 2 cells to one), and who is whose neighbour on each.
#include <bit>

#include "fields/background_grid.h"

namespace amhex::fields {
namespace {

// Coarsening ends here; neighbours of so few nodes are found by trying all pairs.
constexpr int64_t kCoarsestCount = 8;

GridLevel MakeParents(GridLevel* fine) {
  GridLevel coarse;
  fine->parent.resize(fine->count());
  for (int64_t i = 0; i < fine->count(); ++i) {
    const uint64_t key = fine->key[i] >> 3;
    if (coarse.key.empty() || coarse.key.back() != key) coarse.key.push_back(key);
    fine->parent[i] = static_cast<int32_t>(coarse.count() - 1);
  }
  return coarse;
}

std::array<int32_t, 3> Shifted(const std::array<int32_t, 3>& cell, int k) {
  return {cell[0] + NeighbourOffset(k, 0), cell[1] + NeighbourOffset(k, 1),
          cell[2] + NeighbourOffset(k, 2)};
}

void FindNeighboursByPairs(GridLevel* level) {
  level->neighbours.resize(level->count());
  for (int64_t i = 0; i < level->count(); ++i) {
    const std::array<int32_t, 3> cell = CellOfKey(level->key[i]);
    for (int k = 0; k < kNeighbourCount; ++k) {
      level->neighbours[i][k] = -1;
      for (int64_t j = 0; j < level->count(); ++j) {
        if (CellOfKey(level->key[j]) == Shifted(cell, k)) {
          level->neighbours[i][k] = static_cast<int32_t>(j);
        }
      }
    }
  }
}

// Index of the neighbour offset (x, y, z); -1 for the null offset and for space diagonals.
int NeighbourIndex(int x, int y, int z) {
  for (int k = 0; k < kNeighbourCount; ++k) {
    if (NeighbourOffset(k, 0) != x || NeighbourOffset(k, 1) != y) continue;
    if (NeighbourOffset(k, 2) == z) return k;
  }
  return -1;
}

// Children of a node stand together in Morton order: their first index and which octants exist.
struct Children {
  int32_t first = 0;
  uint8_t mask = 0;

  int32_t Find(unsigned octant) const {
    if ((mask >> octant & 1) == 0) return -1;
    return first + std::popcount(static_cast<unsigned>(mask & ((1U << octant) - 1)));
  }
};

std::vector<Children> ListChildren(const GridLevel& fine, int64_t parent_count) {
  std::vector<Children> children(parent_count);
  for (int64_t i = 0; i < fine.count(); ++i) {
    Children& family = children[fine.parent[i]];
    if (family.mask == 0) family.first = static_cast<int32_t>(i);
    family.mask = static_cast<uint8_t>(family.mask | 1U << (fine.key[i] & 7));
  }
  return children;
}

// A neighbour is a sibling or the child of a neighbour of the parent.
class NeighbourFinder {
 public:
  NeighbourFinder(const GridLevel& coarse, const GridLevel& fine)
      : coarse_(coarse), fine_(fine), children_(ListChildren(fine, coarse.count())) {
    for (int octant = 0; octant < 8; ++octant) {
      for (int k = 0; k < kNeighbourCount; ++k) {
        std::array<int, 3> step{};
        unsigned target = 0;
        for (int axis = 0; axis < 3; ++axis) {
          const int c = (octant >> axis & 1) + NeighbourOffset(k, axis);
          step[axis] = c < 0 ? -1 : c / 2;
          target |= static_cast<unsigned>(c & 1) << axis;
        }
        rule_[octant][k] = {NeighbourIndex(step[0], step[1], step[2]), target};
      }
    }
  }

  int32_t Find(int64_t node, int k) const {
    const Rule& rule = rule_[fine_.key[node] & 7][k];
    int32_t family = fine_.parent[node];
    if (rule.parent_neighbour >= 0) family = coarse_.neighbours[family][rule.parent_neighbour];
    return family < 0 ? -1 : children_[family].Find(rule.octant);
  }

 private:
  struct Rule {
    int parent_neighbour = -1;  // -1 = the parent itself
    unsigned octant = 0;
  };
  const GridLevel& coarse_;
  const GridLevel& fine_;
  std::vector<Children> children_;
  std::array<std::array<Rule, kNeighbourCount>, 8> rule_;
};

void SumWeights(const GridLevel& fine, GridLevel* coarse, const RunContext& run) {
  coarse->weights.assign(coarse->count(), {});
  const std::vector<Children> children = ListChildren(fine, coarse->count());
  ForEach(run, coarse->count(), [&](int64_t parent) {
    const std::array<int32_t, 3> cell = CellOfKey(coarse->key[parent]);
    const int32_t first = children[parent].first;
    const int32_t end = first + std::popcount(children[parent].mask);
    for (int32_t i = first; i < end; ++i) {
      for (int k = 0; k < kNeighbourCount; ++k) {
        const int32_t j = fine.neighbours[i][k];
        if (j < 0 || fine.parent[j] == parent) continue;
        const std::array<int32_t, 3> other = CellOfKey(coarse->key[fine.parent[j]]);
        const int index =
            NeighbourIndex(other[0] - cell[0], other[1] - cell[1], other[2] - cell[2]);
        const float weight = !fine.weights.empty() ? fine.weights[i][k]
                             : IsAxisNeighbour(k)  ? kAxisWeight
                                                   : kDiagonalWeight;
        coarse->weights[parent][index] += weight;
      }
    }
  });
}

}  // namespace

absl::Status BuildPyramid(BackgroundGrid* grid, const RunContext& run) {
  std::vector<GridLevel>& levels = grid->levels;
  while (levels.back().count() > kCoarsestCount) {
    GridLevel coarse = MakeParents(&levels.back());
    levels.push_back(std::move(coarse));
    if (absl::Status status = run.CheckStop(); !status.ok()) return status;
  }
  FindNeighboursByPairs(&levels.back());
  for (size_t l = levels.size() - 1; l-- > 0;) {
    GridLevel& level = levels[l];
    const NeighbourFinder finder(levels[l + 1], level);
    level.neighbours.resize(level.count());
    ForEach(run, level.count(), [&](int64_t i) {
      for (int k = 0; k < kNeighbourCount; ++k) level.neighbours[i][k] = finder.Find(i, k);
    });
    if (absl::Status status = run.CheckStop(); !status.ok()) return status;
  }
  for (size_t l = 0; l < levels.size(); ++l) {
    if (l > 0) SumWeights(levels[l - 1], &levels[l], run);
    for (int64_t i = 0; i < levels[l].count(); ++i) {
      levels[l].colours[levels[l].key[i] & 7].push_back(static_cast<int32_t>(i));
    }
    if (absl::Status status = run.CheckStop(); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace amhex::fields
