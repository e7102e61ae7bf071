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

// Tells every lane the value of those that speak, which all have the same. Of what lanes reduce
// together the compiler knows that it is the same everywhere, and does not check before the votes
// that follow whether all lanes have come.
__device__ inline unsigned ToldByOne(unsigned value, bool is_speaking) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
  const unsigned speaking = __ballot_sync(kWholeWarp, is_speaking);
  return __shfl_sync(kWholeWarp, value, __ffs(static_cast<int>(speaking)) - 1);
#else
  return __reduce_or_sync(kWholeWarp, is_speaking ? value : 0u);
#endif
}

// Which points of a block belong to which candidate: every lane of `near`, which each stand for a
// candidate and this block, returns its own. `step` leads from the block's centre to the point that
// the lane looks at.
__device__ inline unsigned OwnPointsTogether(const GroupMemory& shared, unsigned near,
                                             const Vec3f& step, float limit) {
  const int lane = static_cast<int>(threadIdx.x) % kWarpWidth;
  const CentreDistance* from_centre = shared.from_centre[threadIdx.x / kWarpWidth];
  float nearest = limit;
  unsigned own = 0;
  AMHEX_ROLLED
  for (unsigned left = near; left != 0; left &= left - 1) {
    const int other = __ffs(static_cast<int>(left)) - 1;
    const CentreDistance centre = from_centre[other];
    const SiteMetric site = shared.candidate[centre.place].Metric();
    const float distance =
        DistanceOf(ComponentsBeside({centre.a, centre.b, centre.c}, site.row, step));
    // Ids ascend: the first of equal distances stays.
    const unsigned taken = __ballot_sync(kWholeWarp, distance < nearest);
    nearest = Smaller(nearest, distance);
    own = lane == other ? taken : own & ~taken;
  }
  return own;
}

// What one point at an offset from the group's base adds.
__device__ inline FirstSums SumsOfPoint(const LatticePoint& at) {
  return {1u + (static_cast<uint32_t>(at.z) << kHalfWord),
          static_cast<uint32_t>(at.x) + (static_cast<uint32_t>(at.y) << kHalfWord)};
}

// What a lane adds up for its candidate, relative to the group's base.
struct LaneSums : FirstSums {
  // The owned points of a block with this first point.
  __device__ void Add(unsigned owned, const FirstSums& first) {
    const auto n = static_cast<uint32_t>(CountBits(owned));
    const auto in_block = [owned](uint32_t low, uint32_t high) {
      return static_cast<uint32_t>(SumOfCoordinate(owned, low, high));
    };
    count_z += n * first.count_z + (in_block(kZLow, kZHigh) << kHalfWord);
    x_y += n * first.x_y + in_block(kXLow, kXHigh) + (in_block(kYLow, kYHigh) << kHalfWord);
  }
};

// Second moments are rare enough to go to shared memory at once and leave the registers alone.
__device__ inline void AddSecondSums(unsigned owned, const LatticePoint& offset, SecondSums& sums) {
  if (owned == 0) return;
  const CellMoments m = SecondMomentsOf(owned, offset);
  atomicAdd(&sums.sum[0], static_cast<int32_t>(m.xx));
  atomicAdd(&sums.sum[1], static_cast<int32_t>(m.yy));
  atomicAdd(&sums.sum[2], static_cast<int32_t>(m.zz));
  atomicAdd(&sums.sum[3], static_cast<int32_t>(m.xy));
  atomicAdd(&sums.sum[4], static_cast<int32_t>(m.yz));
  atomicAdd(&sums.sum[5], static_cast<int32_t>(m.zx));
}

__device__ inline void StoreLabel(const LabelTileBody& body, const WarpCube& cube, int block,
                                  int32_t site) {
  if (body.labels.empty()) return;
  const int64_t first =
      static_cast<int64_t>(cube.item) * kTilePoints + int64_t{block} * kBlockPoints;
  body.labels[first + static_cast<int>(threadIdx.x) % kWarpWidth] = site;
}

// In a round of LabelWithList a lane stands for one block and one candidate of the list, lane =
// (block in the round << shift) + candidate.
struct LaneRole {
  int shift;
  int candidate;    // of the list
  int first;        // lane of the same block
  unsigned beside;  // all lanes of the same block

  __device__ explicit LaneRole(int listed) : shift(PowerNotBelow(listed)) {
    const int lane = static_cast<int>(threadIdx.x) % kWarpWidth;
    const int lanes = 1 << shift;
    candidate = lane & (lanes - 1);
    first = lane - candidate;
    beside = kWholeWarp >> (kWarpWidth - lanes) << first;
  }
};

__device__ inline LatticePoint BlockInGroup(const WarpCube& cube, int block) {
  const LatticePoint in_cube = BlockInTile(block);
  return {cube.offset.x + in_cube.x, cube.offset.y + in_cube.y, cube.offset.z + in_cube.z};
}

// The same added up: what one point adds, given what one at the first point of the cube does.
__device__ inline FirstSums SumsOfBlock(const FirstSums& of_cube, int block) {
  const auto bits = static_cast<uint32_t>(block);
  static_assert(kBlockWidth == 4, "bits of the block become coordinates");
  return {of_cube.count_z + ((bits & 4u) << kHalfWord),
          of_cube.x_y + ((bits & 1u) << 2) + ((bits & 2u) << (kHalfWord + 1))};
}

// The centre of a block, whole numbers and halves: exact.
template <int kWarpBlocks>
__device__ inline Vec3f CentreOfBlock(const WarpCube& cube, int block) {
  constexpr float kStep = kWarpBlocks == 1 ? 0.0f : 0.5f * kBlockWidth;
  return {cube.centre.x + ((block & 1) != 0 ? kStep : -kStep),
          cube.centre.y + ((block & 2) != 0 ? kStep : -kStep),
          cube.centre.z + ((block & 4) != 0 ? kStep : -kStep)};
}

// Bounds the candidate of the lane over its block, and leaves how far the block's centre is from it
// in `from_centre`. Returns which lanes of the same block have candidates that may own its points.
template <int kWarpBlocks>
__device__ inline unsigned BoundRound(GroupMemory& shared, const WarpCube& cube,
                                      const SiteMetric& site, int32_t place, const LaneRole& role,
                                      bool is_listed, float limit, int block) {
  const int lane = static_cast<int>(threadIdx.x) % kWarpWidth;
  const MetricComponents at = ComponentsAt(site, CentreOfBlock<kWarpBlocks>(cube, block));
  bool is_near = is_listed && block < kWarpBlocks;
  if (kWarpBlocks > 1) {
    const DistanceBounds bounds = BoundsAround(at, site.reach, kBlockHalfWidth);
    const float upper = SmallestInGroup(is_near ? bounds.upper : kUnboundedReach, 1 << role.shift);
    is_near = is_near && bounds.lower <= Smaller(upper, limit) + kCullSlack;
  }
  const unsigned near = __ballot_sync(kWholeWarp, is_near) & role.beside;
  // Not before all lanes have read those of the round before, nor read before all are there.
  __syncwarp();
  shared.from_centre[threadIdx.x / kWarpWidth][lane] = {at.a, at.b, at.c, place};
  __syncwarp();
  return near;
}

// Writes the labels of a block; `owned` as of OwnPointsTogether.
__device__ inline void StoreLabels(const LabelTileBody& body, const WarpCube& cube,
                                   const GroupMemory& shared, int block, unsigned owned) {
  const int lane = static_cast<int>(threadIdx.x) % kWarpWidth;
  const uint8_t* list = shared.warp_list[threadIdx.x / kWarpWidth];
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
  const LaneRole role(listed);
  const int blocks = Smaller(kWarpBlocks, kWarpWidth >> role.shift);
  const bool is_listed = role.candidate < listed;
  const int32_t place = is_listed ? shared.warp_list[warp][role.candidate] : 0;
  const SiteMetric site = shared.candidate[place].Metric();
  const Vec3f step = StepFromCentre(lane);
  const FirstSums of_cube = SumsOfPoint(cube.offset);
  LaneSums sums;
  AMHEX_ROLLED
  for (int first = 0; first < kWarpBlocks; first += blocks) {
    const int block = first + (lane >> role.shift);
    const unsigned near =
        BoundRound<kWarpBlocks>(shared, cube, site, place, role, is_listed, search.limit, block);
    const unsigned points = block < kWarpBlocks ? body.PointsOf(item, cube.first_block + block) : 0;
    const bool is_alone = (near & (near - 1u)) == 0 && search.is_inside != 0;
    unsigned owned = is_alone && near == 1u << lane ? kWholeWarp : 0u;
    unsigned left = __ballot_sync(kWholeWarp, role.candidate == 0 && !is_alone && points != 0);
    AMHEX_ROLLED
    for (; left != 0; left &= left - 1) {
      const int speaker = __ffs(static_cast<int>(left)) - 1;
      const unsigned near_there = ToldByOne(near, role.first == speaker);
      const unsigned owned_there = OwnPointsTogether(shared, near_there, step, search.limit);
      if (role.first == speaker) owned = owned_there;
    }
    owned &= points;
    sums.Add(owned, SumsOfBlock(of_cube, block));
    if (wants_second) {
      AddSecondSums(owned, BlockInGroup(cube, block % kTileBlocks), shared.second[place]);
    }
    if (body.labels.empty()) continue;
    AMHEX_ROLLED
    for (int i = 0; i < blocks; ++i) {
      const unsigned of_block =
          __shfl_sync(kWholeWarp, owned, ((i << role.shift) + lane) % kWarpWidth);
      StoreLabels(body, cube, shared, cube.first_block + first + i,
                  lane == role.candidate ? of_block : 0u);
    }
  }
  if (sums.count_z == 0) return;
  FirstSums& of_group = shared.candidate[place].sums;
  atomicAdd(&of_group.count_z, sums.count_z);
  atomicAdd(&of_group.x_y, sums.x_y);
}

// The owner of the lane's point among all of the group's candidates.
__device__ inline int32_t OwnerAmongAll(const GroupMemory& shared, int count, const Vec3f& centre,
                                        const Vec3f& step, float limit) {
  float nearest = limit;
  int32_t owner = kNoOwner;
  AMHEX_ROLLED
  for (int k = 0; k < count; ++k) {
    const float distance = ChebyshevDistance(shared.candidate[k].Metric(), centre, step);
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
  const Vec3f step = StepFromCentre(lane);
  AMHEX_ROLLED
  for (int i = 0; i < kWarpBlocks; ++i) {
    const LatticePoint in_cube = BlockInTile(i);
    const LatticePoint at = {cube.offset.x + in_cube.x, cube.offset.y + in_cube.y,
                             cube.offset.z + in_cube.z};
    const unsigned points = body.PointsOf(item, cube.first_block + i);
    const Vec3f centre = CentreOfBlock<kWarpBlocks>(cube, i);
    int32_t owner = count >= 0 ? OwnerAmongAll(shared, count, centre, step, search.limit)
                               : body.OwnerByScan(search, centre, step);
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
    const FirstSums& sums = shared.candidate[k].sums;
    const int64_t n = sums.count_z & kLowHalf;
    if (n == 0) continue;
    CellMoments& cell = body.moments[shared.candidate[k].id];
    const int64_t x = sums.x_y & kLowHalf, y = sums.x_y >> kHalfWord, z = sums.count_z >> kHalfWord;
    AtomicAdd(&cell.count, n);
    AtomicAdd(&cell.x, n * base.x + x);
    AtomicAdd(&cell.y, n * base.y + y);
    AtomicAdd(&cell.z, n * base.z + z);
    if (!body.WantsSecondMoments()) continue;
    const int32_t* second = shared.second[k].sum;
    AtomicAdd(&cell.xx, ShiftedProduct(n, base.x, x, base.x, x, second[0]));
    AtomicAdd(&cell.yy, ShiftedProduct(n, base.y, y, base.y, y, second[1]));
    AtomicAdd(&cell.zz, ShiftedProduct(n, base.z, z, base.z, z, second[2]));
    AtomicAdd(&cell.xy, ShiftedProduct(n, base.x, x, base.y, y, second[3]));
    AtomicAdd(&cell.yz, ShiftedProduct(n, base.y, y, base.z, z, second[4]));
    AtomicAdd(&cell.zx, ShiftedProduct(n, base.z, z, base.x, x, second[5]));
  }
}

// The cube of one warp: an octant of the group, or of its only tile.
template <int kWarpBlocks>
__device__ inline WarpCube CubeOfWarp(const LabelGroup& group) {
  constexpr int kCubeWidth = kWarpBlocks == 1 ? kBlockWidth : kTileWidth;
  constexpr float kHalfWidth = kWarpBlocks == 1 ? kBlockHalfWidth : kTileHalfWidth;
  const int warp = static_cast<int>(threadIdx.x) / kWarpWidth;
  WarpCube cube;
  const LatticePoint octant = BlockInTile(warp);
  constexpr int kScale = kCubeWidth / kBlockWidth;
  cube.offset = {octant.x * kScale, octant.y * kScale, octant.z * kScale};
  cube.item = group.item[kWarpBlocks == 1 ? 0 : warp];
  cube.first_block = kWarpBlocks == 1 ? warp : 0;
  cube.centre = CentreInGroup(group.base, cube.offset, kHalfWidth);
  cube.half_width = kHalfWidth;
  return cube;
}

template <int kWarpBlocks>
__device__ inline LabelTileBody::Search SearchOf(const LabelGroup& group) {
  constexpr int kWidth = kWarpBlocks == 1 ? kTileWidth : kGroupWidth;
  LabelTileBody::Search search;
  search.base = group.base;
  search.half_width = 0.5f * (kWidth - 1);
  search.centre = CentreOfCube(group.base, search.half_width);
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
  // One thread reads, so that all of the block stay or leave.
  if (threadIdx.x == 0) {
    shared.is_stopped = *static_cast<const volatile int32_t*>(stop_flag);
    shared.search = SearchOf<kWarpBlocks>(group);
  }
  __syncthreads();
  if (shared.is_stopped != 0) return;
  LabelTileBody::Search search = shared.search;
  WarpCube cube = CubeOfWarp<kWarpBlocks>(group);
  const int count = GatherTogether(body, search, cube, shared);
  if (body.WantsSecondMoments()) {
    AMHEX_ROLLED
    for (int k = static_cast<int>(threadIdx.x); k < count; k += kGroupThreads) {
      shared.second[k] = SecondSums{};
    }
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
