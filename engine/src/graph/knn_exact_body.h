// N_26 by grid hashing: exact, one pass, no start needed.
//
// deviates: the paper updates a random graph by neighbours of neighbours (knn_update_body.h),
// which is approximate and needs seven passes; the neighbours found are the same.
#pragma once

#include <cstdint>

#include "graph/bin_grid.h"
#include "graph/knn_graph.h"

namespace amhex {

// Searches shells of bins outwards until no unseen node can be nearer than the 26th. Expected
// O(1) per node where bins hold about one node each.
struct KnnExactBody {
  BinGrid grid;
  ArrayView<const Vec3f> position;  // [node_count]
  ArrayView<int32_t> neighbours;    // [query_count][26]; queries are the first nodes

  AMHEX_HD void operator()(int64_t node) const {
    const Vec3f centre = position[node];
    const int32_t bin[3] = {grid.CoordinateOf(centre.x, grid.count_x),
                            grid.CoordinateOf(centre.y, grid.count_y),
                            grid.CoordinateOf(centre.z, grid.count_z)};
    const int32_t last_shell = Larger(grid.count_x, Larger(grid.count_y, grid.count_z));
    NearestNodes nearest;
    for (int32_t shell = 0; shell <= last_shell; ++shell) {
      VisitShell(bin, shell, static_cast<int32_t>(node), centre, nearest);
      // Unseen nodes are farther than the whole shells around the node's own bin.
      const float reach = static_cast<float>(shell) * grid.bin_size;
      if (nearest.IsFull() && nearest.squared_distance[kNeighbourCount - 1] <= reach * reach) break;
    }
    nearest.WriteTo(&neighbours[node * kNeighbourCount]);
  }

  AMHEX_HD void VisitShell(const int32_t (&bin)[3], int32_t shell, int32_t node,
                           const Vec3f& centre, NearestNodes& nearest) const {
    for (int32_t dz = -shell; dz <= shell; ++dz) {
      const int32_t z = bin[2] + dz;
      if (z < 0 || z >= grid.count_z) continue;
      for (int32_t dy = -shell; dy <= shell; ++dy) {
        const int32_t y = bin[1] + dy;
        if (y < 0 || y >= grid.count_y) continue;
        const bool is_face = dz == -shell || dz == shell || dy == -shell || dy == shell;
        if (is_face || shell == 0) {
          VisitRow(bin[0] - shell, bin[0] + shell, y, z, node, centre, nearest);
        } else {
          VisitRow(bin[0] - shell, bin[0] - shell, y, z, node, centre, nearest);
          VisitRow(bin[0] + shell, bin[0] + shell, y, z, node, centre, nearest);
        }
      }
    }
  }

  AMHEX_HD void VisitRow(int32_t low, int32_t high, int32_t y, int32_t z, int32_t node,
                         const Vec3f& centre, NearestNodes& nearest) const {
    low = Larger(low, 0);
    high = Smaller(high, grid.count_x - 1);
    if (low > high) return;
    const int64_t begin = grid.starts[grid.BinAt(low, y, z)];
    const int64_t end = grid.starts[grid.BinAt(high, y, z) + 1];
    for (int64_t slot = begin; slot < end; ++slot) {
      const int32_t other = grid.ids[slot];
      if (other != node) nearest.Offer(SquaredDistance(position[other], centre), other);
    }
  }
};

}  // namespace amhex
