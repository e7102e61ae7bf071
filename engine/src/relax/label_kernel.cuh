// The labelling of label_body.h by cooperating threads: one thread block per group of tiles, one
// warp per tile (or per block of a lone tile), one lane per lattice point or per candidate site.
//
// Labels and sums are those of the body, bit for bit: the same exact culling, the same distances,
// ties by id, integer sums. Sums are kept in registers per candidate, joined in shared memory per
// group, and reach memory once per group and cell. Lattice points are never stored.
#pragma once

#include <cstdint>

#include "relax/label_cull.cuh"

namespace amhex {

// The lane's point in the block at an offset from the group's base.
struct LanePoint {
  const float* x;
  const float* y;
  const float* z;

  __device__ explicit LanePoint(const GroupMemory& shared) {
    const LatticePoint q = PointInBlock(static_cast<int>(threadIdx.x) % kWarpWidth);
    x = shared.axis[0] + q.x, y = shared.axis[1] + q.y, z = shared.axis[2] + q.z;
  }
  __device__ Vec3f At(const LatticePoint& offset) const {
    return {x[offset.x], y[offset.y], z[offset.z]};
  }
};

// Which points of the block belong to which of the list's candidates in `near`: every lane returns
// those of candidate `number`.
__device__ inline unsigned OwnPointsTogether(const GroupMemory& shared, unsigned near,
                                             const Vec3f& position, float limit, int number) {
  const int32_t* list = shared.warp_list[threadIdx.x / kWarpWidth];
  float nearest = limit;
  unsigned own = 0;
  AMHEX_ROLLED
  for (unsigned left = near; left != 0; left &= left - 1) {
    const int k = __ffs(static_cast<int>(left)) - 1;
    const float distance = ChebyshevDistance(shared.candidate[list[k]].Metric(), position);
    // Ids ascend: the first of equal distances stays.
    const unsigned taken = __ballot_sync(kWholeWarp, distance < nearest);
    nearest = Smaller(nearest, distance);
    own = number == k ? taken : own & ~taken;
  }
  return own;
}

// What a lane adds up for its candidate, relative to the group's base: at most 2048 points with
// coordinates below 16.
struct LaneSums {
  int32_t count = 0, x = 0, y = 0, z = 0;

  __device__ void Add(unsigned owned, const LatticePoint& offset) {
    const int32_t n = CountBits(owned);
    count += n;
    x += n * offset.x + SumOfCoordinate(owned, kXLow, kXHigh);
    y += n * offset.y + SumOfCoordinate(owned, kYLow, kYHigh);
    z += n * offset.z + SumOfCoordinate(owned, kZLow, kZHigh);
  }
};

// Second moments are rare enough to go to shared memory at once and leave the registers alone.
__device__ inline void AddSecondSums(unsigned owned, const LatticePoint& offset,
                                     PartialSums& sums) {
  if (owned == 0) return;
  const CellMoments m = SecondMomentsOf(owned, offset);
  atomicAdd(&sums.second[0], static_cast<int32_t>(m.xx));
  atomicAdd(&sums.second[1], static_cast<int32_t>(m.yy));
  atomicAdd(&sums.second[2], static_cast<int32_t>(m.zz));
  atomicAdd(&sums.second[3], static_cast<int32_t>(m.xy));
  atomicAdd(&sums.second[4], static_cast<int32_t>(m.yz));
  atomicAdd(&sums.second[5], static_cast<int32_t>(m.zx));
}

__device__ inline void StoreLabel(const LabelTileBody& body, const WarpCube& cube, int block,
                                  int32_t site) {
  if (body.labels.empty()) return;
  const int64_t first =
      static_cast<int64_t>(cube.item) * kTilePoints + int64_t{block} * kBlockPoints;
  body.labels[first + static_cast<int>(threadIdx.x) % kWarpWidth] = site;
}

// One round of LabelWithList: a lane stands for one block and one candidate of the list, lane =
// (block in the round << shift) + candidate.
struct LaneInRound {
  LatticePoint at;           // of the lane's block, from the group's base
  unsigned points = 0;       // of the lane's block; 0 where there is none
  unsigned near = 0;         // which candidates may own points of it
  unsigned near_of_all = 0;  // the same for every lane: bit = lane
};

__device__ inline LatticePoint BlockInGroup(const WarpCube& cube, int block) {
  const LatticePoint in_cube = BlockInTile(block);
  return {cube.offset.x + in_cube.x, cube.offset.y + in_cube.y, cube.offset.z + in_cube.z};
}

__device__ inline unsigned WidthMask(int shift) {
  return kWholeWarp >> (kWarpWidth - (1 << shift));
}

// Bounds the candidates over the blocks from `first` on.
template <int kWarpBlocks>
__device__ inline LaneInRound BoundRound(const GroupMemory& shared, const WarpCube& cube,
                                         const SiteMetric& site, bool is_listed, float limit,
                                         int first, int shift) {
  const int lane = static_cast<int>(threadIdx.x) % kWarpWidth;
  const int block = first + (lane >> shift);
  const bool is_block = block < kWarpBlocks;
  LaneInRound round;
  round.at = BlockInGroup(cube, is_block ? block : 0);
  bool is_near = is_listed && is_block;
  if (kWarpBlocks > 1) {
    const DistanceBounds bounds =
        BoundsOverCube(site, CentreBetween(shared, round.at, kBlockWidth), shared.block_half_width);
    const float upper = SmallestInGroup(is_near ? bounds.upper : kUnboundedReach, 1 << shift);
    is_near = is_near && bounds.lower <= Smaller(upper, limit) + kCullSlack;
  }
  round.near_of_all = __ballot_sync(kWholeWarp, is_near);
  round.near = (round.near_of_all >> (lane >> shift << shift)) & WidthMask(shift);
  return round;
}

// Writes the labels of a block; `owned` as of OwnPointsTogether.
__device__ inline void StoreLabels(const LabelTileBody& body, const WarpCube& cube,
                                   const GroupMemory& shared, int block, unsigned owned) {
  const int lane = static_cast<int>(threadIdx.x) % kWarpWidth;
  const int32_t* list = shared.warp_list[threadIdx.x / kWarpWidth];
  int32_t owner = kNoOwner;
  AMHEX_ROLLED
  for (int k = 0; k < kWarpWidth; ++k) {
    const unsigned points = __shfl_sync(kWholeWarp, owned, k);
    if (((points >> lane) & 1u) != 0) owner = shared.candidate[list[k]].id;
  }
  StoreLabel(body, cube, block, owner);
}

// Labels the warp's blocks with the candidates of its list. Blocks of one cell need no look at
// their points; in the others, one after the other, a lane stands for a point.
template <int kWarpBlocks>
__device__ inline void LabelWithList(const LabelTileBody& body, const LabelTileBody::Search& search,
                                     const WarpCube& cube, int listed, GroupMemory& shared) {
  const int warp = static_cast<int>(threadIdx.x) / kWarpWidth;
  const int lane = static_cast<int>(threadIdx.x) % kWarpWidth;
  const LabelItem item = body.items[cube.item];
  const bool wants_second = body.WantsSecondMoments();
  int shift = 0;
  while ((1 << shift) < listed) ++shift;
  const int blocks = Smaller(kWarpBlocks, kWarpWidth >> shift);
  const int own = lane & ((1 << shift) - 1);
  const int32_t place = own < listed ? shared.warp_list[warp][own] : 0;
  const SiteMetric site = shared.candidate[place].Metric();
  const LanePoint point(shared);
  LaneSums sums;
  AMHEX_ROLLED
  for (int first = 0; first < kWarpBlocks; first += blocks) {
    LaneInRound round =
        BoundRound<kWarpBlocks>(shared, cube, site, own < listed, search.limit, first, shift);
    const int own_block = first + (lane >> shift);
    if (own_block < kWarpBlocks) round.points = body.PointsOf(item, cube.first_block + own_block);
    const bool is_alone = (round.near & (round.near - 1u)) == 0 && search.is_inside != 0;
    unsigned owned = is_alone && (round.near >> own) == 1u ? kWholeWarp : 0u;
    unsigned left = __ballot_sync(kWholeWarp, own == 0 && !is_alone && round.points != 0);
    AMHEX_ROLLED
    for (; left != 0; left &= left - 1) {
      const int speaker = __ffs(static_cast<int>(left)) - 1;
      const unsigned near = (round.near_of_all >> speaker) & WidthMask(shift);
      const LatticePoint at = BlockInGroup(cube, first + (speaker >> shift));
      const unsigned owned_there =
          OwnPointsTogether(shared, near, point.At(at), search.limit, lane - speaker);
      if (((lane ^ speaker) >> shift) == 0) owned = owned_there;
    }
    owned &= round.points;
    sums.Add(owned, round.at);
    if (wants_second) AddSecondSums(owned, round.at, shared.sums[place]);
    if (body.labels.empty()) continue;
    AMHEX_ROLLED
    for (int i = 0; i < blocks; ++i) {
      const unsigned of_block = __shfl_sync(kWholeWarp, owned, ((i << shift) + lane) % kWarpWidth);
      StoreLabels(body, cube, shared, cube.first_block + first + i, lane == own ? of_block : 0u);
    }
  }
  if (sums.count == 0) return;
  int32_t* group_sums = shared.sums[place].first;
  atomicAdd(&group_sums[0], sums.count);
  atomicAdd(&group_sums[1], sums.x);
  atomicAdd(&group_sums[2], sums.y);
  atomicAdd(&group_sums[3], sums.z);
}

// The owner of the lane's point among all of the group's candidates.
__device__ inline int32_t OwnerAmongAll(const GroupMemory& shared, int count, const Vec3f& position,
                                        float limit) {
  float nearest = limit;
  int32_t owner = kNoOwner;
  AMHEX_ROLLED
  for (int k = 0; k < count; ++k) {
    const float distance = ChebyshevDistance(shared.candidate[k].Metric(), position);
    const int32_t id = shared.candidate[k].id;
    if (distance < nearest || (distance == nearest && owner != kNoOwner && id < owner)) {
      nearest = distance;
      owner = id;
    }
  }
  return owner;
}

// The same for crowded places, where a list has no room: every candidate for every point, or every
// site near the group; sums go straight to memory.
template <int kWarpBlocks>
__device__ inline void LabelWithoutList(const LabelTileBody& body,
                                        const LabelTileBody::Search& search, const WarpCube& cube,
                                        int count, const GroupMemory& shared) {
  const int lane = static_cast<int>(threadIdx.x) % kWarpWidth;
  const LabelItem item = body.items[cube.item];
  AMHEX_ROLLED
  for (int i = 0; i < kWarpBlocks; ++i) {
    const LatticePoint in_cube = BlockInTile(i);
    const LatticePoint at = {cube.offset.x + in_cube.x, cube.offset.y + in_cube.y,
                             cube.offset.z + in_cube.z};
    const unsigned points = body.PointsOf(item, cube.first_block + i);
    const Vec3f position = LanePoint(shared).At(at);
    int32_t owner = count >= 0 ? OwnerAmongAll(shared, count, position, search.limit)
                               : body.OwnerByScan(search, position);
    if (((points >> lane) & 1u) == 0) owner = kNoOwner;
    StoreLabel(body, cube, cube.first_block + i, owner);
    const LatticePoint base = {search.base.x + at.x, search.base.y + at.y, search.base.z + at.z};
    unsigned left = __ballot_sync(kWholeWarp, owner != kNoOwner);
    while (left != 0) {
      const int leader = __ffs(static_cast<int>(left)) - 1;
      const int32_t site = __shfl_sync(kWholeWarp, owner, leader);
      const unsigned owned = __ballot_sync(kWholeWarp, owner == site);
      if (lane == leader) {
        AddFirstMoments(owned, base, body.moments[site]);
        if (body.WantsSecondMoments()) AddSecondMoments(owned, base, body.moments[site]);
      }
      left &= ~owned;
    }
  }
}

// Sends the group's sums to the cells: one thread per candidate.
__device__ inline void FlushSums(const LabelTileBody& body, const LatticePoint& base, int count,
                                 const GroupMemory& shared) {
  AMHEX_ROLLED
  for (int k = static_cast<int>(threadIdx.x); k < count; k += kGroupThreads) {
    const PartialSums& sums = shared.sums[k];
    const int64_t n = sums.first[0];
    if (n == 0) continue;
    CellMoments& cell = body.moments[shared.candidate[k].id];
    const int64_t x = sums.first[1], y = sums.first[2], z = sums.first[3];
    AtomicAdd(&cell.count, n);
    AtomicAdd(&cell.x, n * base.x + x);
    AtomicAdd(&cell.y, n * base.y + y);
    AtomicAdd(&cell.z, n * base.z + z);
    if (!body.WantsSecondMoments()) continue;
    AtomicAdd(&cell.xx, ShiftedProduct(n, base.x, x, base.x, x, sums.second[0]));
    AtomicAdd(&cell.yy, ShiftedProduct(n, base.y, y, base.y, y, sums.second[1]));
    AtomicAdd(&cell.zz, ShiftedProduct(n, base.z, z, base.z, z, sums.second[2]));
    AtomicAdd(&cell.xy, ShiftedProduct(n, base.x, x, base.y, y, sums.second[3]));
    AtomicAdd(&cell.yz, ShiftedProduct(n, base.y, y, base.z, z, sums.second[4]));
    AtomicAdd(&cell.zx, ShiftedProduct(n, base.z, z, base.x, x, sums.second[5]));
  }
}

// The cube of one warp: an octant of the group, or of its only tile.
template <int kWarpBlocks>
__device__ inline WarpCube CubeOfWarp(const LabelGroup& group, const GroupMemory& shared) {
  constexpr int kCubeWidth = kWarpBlocks == 1 ? kBlockWidth : kTileWidth;
  const int warp = static_cast<int>(threadIdx.x) / kWarpWidth;
  WarpCube cube;
  const LatticePoint octant = BlockInTile(warp);
  constexpr int kScale = kCubeWidth / kBlockWidth;
  cube.offset = {octant.x * kScale, octant.y * kScale, octant.z * kScale};
  cube.item = group.item[kWarpBlocks == 1 ? 0 : warp];
  cube.first_block = kWarpBlocks == 1 ? warp : 0;
  cube.centre = CentreBetween(shared, cube.offset, kCubeWidth);
  cube.half_width = shared.cube_half_width;
  return cube;
}

template <int kWarpBlocks>
__device__ inline LabelTileBody::Search SearchOf(const LabelTileBody& body,
                                                 const LabelGroup& group) {
  constexpr int kWidth = kWarpBlocks == 1 ? kTileWidth : kGroupWidth;
  const double half_width = 0.5 * (kWidth - 1) * body.barrier.lattice.spacing;
  LabelTileBody::Search search;
  search.base = group.base;
  search.centre = body.CentreOf(group.base, half_width);
  search.half_width = static_cast<float>(half_width);
  search.is_inside = group.is_inside;
  search.limit = group.is_inside != 0 ? kUnboundedReach : kOutsideReach;
  return search;
}

// kWarpBlocks is 8 for groups of tiles and 1 for lone ones. Leaves at once where the flag is set.
template <int kWarpBlocks>
__global__ void __launch_bounds__(kGroupThreads, kBlocksPerMultiprocessor)
    LabelGroupsKernel(LabelTileBody body, ArrayView<const LabelGroup> groups,
                      const int32_t* stop_flag) {
  __shared__ GroupMemory shared;
  const LabelGroup& group = groups[blockIdx.x];
  if (threadIdx.x < 3 * kGroupWidth) {
    const int axis = static_cast<int>(threadIdx.x) / kGroupWidth;
    const int i = static_cast<int>(threadIdx.x) % kGroupWidth;
    const int32_t first = axis == 0 ? group.base.x : (axis == 1 ? group.base.y : group.base.z);
    shared.axis[axis][i] = static_cast<float>((first + i) * body.barrier.lattice.spacing);
  }
  // One thread reads, so that all of the block stay or leave.
  if (threadIdx.x == 0) {
    shared.is_stopped = *static_cast<const volatile int32_t*>(stop_flag);
    shared.search = SearchOf<kWarpBlocks>(body, group);
    shared.block_half_width = static_cast<float>(body.BlockHalfWidth());
    shared.cube_half_width =
        kWarpBlocks == 1 ? shared.block_half_width : static_cast<float>(body.TileHalfWidth());
  }
  __syncthreads();
  if (shared.is_stopped != 0) return;
  LabelTileBody::Search search = shared.search;
  WarpCube cube = CubeOfWarp<kWarpBlocks>(group, shared);
  const int count = GatherTogether(body, search, cube, shared);
  AMHEX_ROLLED
  for (int k = static_cast<int>(threadIdx.x); k < count; k += kGroupThreads) {
    shared.sums[k] = PartialSums{};
  }
  __syncthreads();
  if (cube.item != kNoItem) {
    const int listed = count < 0 ? -1 : ListForWarp(shared, count, cube);
    if (listed >= 0) {
      LabelWithList<kWarpBlocks>(body, search, cube, listed, shared);
    } else {
      LabelWithoutList<kWarpBlocks>(body, search, cube, count, shared);
    }
  }
  __syncthreads();
  FlushSums(body, group.base, count, shared);
}

}  // namespace amhex
