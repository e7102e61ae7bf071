// The labelling of tiles that the kernel before has left: where there are more candidates than a
// list has room for, or owners may be farther away than was searched. Seldom, so nothing is shared
// out: a warp searches for every block anew.
#pragma once

#include <cstdint>

#include "relax/label_gather.cuh"
#include "relax/label_kernel.cuh"

namespace amhex {

// A warp for each block of a tile, as the search takes long.
inline constexpr int kRestThreads = kTileBlocks * kWarpWidth;
// So many groups have a thread block together: most have no tile left, and looking costs as much as
// many groups' words.
inline constexpr int kGroupsOfRestBlock = 16;

// Makes the search reach as far as the owners of its cube's points can be. Returns how far these
// are, in cell sizes.
__device__ inline float WidenReach(const LabelTileBody& body, LabelTileBody::Search& search) {
  while (true) {
    float bound = search.limit;
    VisitSitesTogether(body, search, [&](int32_t slot, bool is_there) {
      if (!is_there) return;
      const SiteMetric site = body.metric[slot];
      if (!site.IsOfSide(search.is_inside)) return;
      bound = Smaller(bound, BoundsOverCube(site, search.centre, search.half_width).upper);
    });
    bound = LeastOfWarp(bound);
    const float needed = body.ReachOf(bound);
    if (needed <= search.reach || body.HasSeenAll(search)) return bound;
    search.reach = bound < kUnboundedReach ? needed : 2 * search.reach;
  }
}

// The owner of the lane's point of the block that is the search's cube, among all sites near it.
__device__ inline int32_t OwnerAmongAll(const LabelTileBody& body, LabelTileBody::Search& search) {
  const Vec3f step = StepFromCentre(LaneOfThread());
  const float bound = WidenReach(body, search) + kCullSlack;
  float nearest = search.limit;
  int32_t owner = kNoOwner;
  VisitSitesTogether(body, search, [&](int32_t slot, bool is_there) {
    const bool is_near = is_there && MayBeWithin(body, search, slot, bound);
    AMHEX_ROLLED
    for (unsigned left = __ballot_sync(kWholeWarp, is_near); left != 0; left &= left - 1) {
      const int32_t other = __shfl_sync(kWholeWarp, slot, __ffs(static_cast<int>(left)) - 1);
      const float distance = ChebyshevDistance(body.metric[other], search.centre, step);
      const int32_t id = body.bins.ids[other];
      if (distance < nearest || (distance == nearest && owner != kNoOwner && id < owner)) {
        nearest = distance;
        owner = id;
      }
    }
  });
  return owner;
}

// Labels a block of a tile with every site near it; sums go straight to memory.
__device__ inline void LabelWithoutList(const LabelTileBody& body,
                                        const LabelTileBody::Search& of_group,
                                        const TileOfWarp& tile, int block) {
  const int lane = LaneOfThread();
  LabelTileBody::Search search = of_group;
  search.half_width = kBlockHalfWidth;
  search.centre = CentreOfBlock(tile, block);
  int32_t owner = OwnerAmongAll(body, search);
  if ((tile.Points(body, block) >> lane & 1u) == 0) owner = kNoOwner;
  StoreLabel(body, tile, block, owner);
  const LatticePoint in_tile = BlockInTile(block);
  const LatticePoint base = {tile.base.x + in_tile.x, tile.base.y + in_tile.y,
                             tile.base.z + in_tile.z};
  unsigned left = __ballot_sync(kWholeWarp, owner != kNoOwner);
  while (left != 0) {
    const int leader = __ffs(static_cast<int>(left)) - 1;
    const int32_t site = __shfl_sync(kWholeWarp, owner, leader);
    const unsigned owned = __ballot_sync(kWholeWarp, owner == site);
    if (lane == leader) {
      AddFirstMoments(owned, base, body.moments[site]);
      if (body.WantsSecondMoments() && body.MayBeSplit(site)) {
        AddSecondMoments(owned, base, body.moments[site]);
      }
    }
    left &= ~owned;
  }
}

// Leaves at once where the flag is set.
static __global__ void __launch_bounds__(kRestThreads, 2)
    LabelRestKernel(LabelTileBody body, ArrayView<const LabelGroup> groups, int tiles,
                    GroupLists lists, const int32_t* stop_flag) {
  const int64_t first = static_cast<int64_t>(blockIdx.x) * kGroupsOfRestBlock;
  AMHEX_ROLLED
  for (int64_t index = first; index < Smaller(first + kGroupsOfRestBlock, groups.size); ++index) {
    AMHEX_ROLLED
    for (uint32_t left = lists.left[index]; left != 0; left &= left - 1) {
      // One lane reads, so that all of the warp stay or leave.
      const int is_stopped =
          LaneOfThread() == 0 ? *static_cast<const volatile int32_t*>(stop_flag) : 0;
      if (__ballot_sync(kWholeWarp, is_stopped != 0) != 0) return;
      LabelTileBody::Search search = SearchOf(groups[index], tiles);
      search.reach = lists.reach[index];
      const int octant = __ffs(static_cast<int>(left)) - 1;
      LabelWithoutList(body, search, TileOf(groups[index], octant), WarpOfThread());
    }
  }
}

}  // namespace amhex
