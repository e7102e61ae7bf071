// The labelling of label_body.h by cooperating threads: one thread block per group of tiles, one
// warp per tile, one lane per candidate site, per block and candidate, or per lattice point.
//
// Labels and sums are those of the body, bit for bit: the same exact culling, the same distances,
// ties by id, integer sums. Each lane keeps the owners of its points of all blocks at once in
// registers; sums reach memory once per tile and cell. Lattice points are never stored. Warps wait
// for each other once, when the group's candidates have been read.
#pragma once

#include <cstdint>

#include "relax/label_owners.cuh"
#include "relax/label_sums.cuh"

namespace amhex {

__device__ inline void StoreLabel(const LabelTileBody& body, const TileOfWarp& tile, int block,
                                  int32_t site) {
  if (body.labels.empty()) return;
  body.labels[static_cast<int64_t>(tile.item) * kTilePoints + int64_t{block} * kBlockPoints +
              LaneOfThread()] = site;
}

// Labels the warp's tile with the candidates of its list.
template <class Work>
__device__ inline void LabelWithList(const LabelTileBody& body, const TileOfWarp& tile, int listed,
                                     LabelMemory<Work>& shared) {
  const int lane = LaneOfThread();
  AMHEX_ROLLED
  for (int first = 0; first < kTileBlocks; first += Work::kAtOnce) {
    LanePoints<Work> points = LabelBlocks<Work>(body, tile, first, listed, shared);
    if (tile.mask >= 0) {
      AMHEX_UNROLLED
      for (int b = 0; b < Work::kAtOnce; ++b) {
        const bool is_there = (tile.Points(body, first + b) >> lane & 1u) != 0;
        if (!is_there) points.owner[b] = kNoOwner;
      }
    }
    SendPoints<Work>(body, tile, first, listed, shared, points);
    if (body.labels.empty()) continue;
    AMHEX_UNROLLED
    for (int b = 0; b < Work::kAtOnce; ++b) {
      const int k = points.owner[b];
      StoreLabel(body, tile, first + b,
                 k < 0 ? kNoOwner : shared.Id(body, shared.listed[WarpOfThread()][k]));
    }
  }
}

// Leaves at once where the flag is set. Tiles whose list would not do are left (label_rest.cuh).
template <class Work>
__global__ void __launch_bounds__(Work::kThreads, kBlocksPerMultiprocessor<Work>)
    LabelGroupsKernel(LabelTileBody body, ArrayView<const LabelGroup> groups, GroupLists lists,
                      const int32_t* stop_flag) {
  __shared__ LabelMemory<Work> shared;
  const int64_t index = blockIdx.x / Work::kParts;
  const int octant = static_cast<int>(blockIdx.x) % Work::kParts * Work::kWarps + WarpOfThread();
  const LabelGroup& group = groups[index];
  const TileOfWarp tile = TileOf(group, octant);
  int count = 0;
  if constexpr (Work::kIsStaged) {
    count = lists.count[index];
    if (count == 0 && group.is_inside == 0 && body.labels.empty()) return;
  }
  // One thread reads, so that all of the block stay or leave.
  if (threadIdx.x == 0) shared.is_stopped = *static_cast<const volatile int32_t*>(stop_flag);
  if constexpr (Work::kIsStaged) {
    StageCandidates<Work>(body, &lists.slots[index * Work::kMost], count, shared);
  }
  __syncthreads();
  if (shared.is_stopped != 0) return;
  if (tile.item == kNoItem) return;
  LabelTileBody::Search search = SearchOf(group, Work::kTiles);
  if constexpr (!Work::kIsStaged) {
    count = GatherSites(body, search, index, lists, shared.gathered, shared.listed[0]);
    __syncwarp();
  }
  search.reach = lists.reach[index];
  const int listed =
      count < 0 ? kTooMany
                : ListForTile<Work>(body, search, tile, count, &lists.next_reach[index], shared);
  if (listed < 0) {
    if (LaneOfThread() == 0) atomicOr(&lists.left[index], 1u << octant);
    return;
  }
  if (listed == 0 && body.labels.empty()) return;
  LabelWithList<Work>(body, tile, listed, shared);
}

}  // namespace amhex
