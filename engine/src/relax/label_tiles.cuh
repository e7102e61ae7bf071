// The labelling of label_body.h by cooperating threads: one thread block per tile, one warp per
// block of 32 lattice points, one lane per point. Labels and sums are those of the body, bit for
// bit: the same exact culling, the same distances, ties by id, integer sums.
#pragma once

#include <cstdint>

#include "exec/cuda_executor.cuh"
#include "relax/label_body.h"

namespace amhex {

inline constexpr int kWarpWidth = 32;
inline constexpr unsigned kWholeWarp = 0xffffffffu;
inline constexpr int kTileThreads = kTileBlocks * kWarpWidth;
static_assert(kBlockPoints == kWarpWidth, "a warp labels a block of the lattice");

// The candidates of one tile in shared memory; rows are padded to an odd number of words, so that
// lanes reading the same member of different candidates use different banks.
struct SharedCandidates {
  int32_t found;  // may exceed the capacity
  int32_t slot[kCandidateCapacity];
  int32_t id[kCandidateCapacity];
  float value[kCandidateCapacity][17];  // x y z, row[9], reach[3]; two unused
  float block_bound[kTileBlocks];
};

__device__ inline SiteMetric CandidateAt(const SharedCandidates& shared, int k) {
  const float* value = shared.value[k];
  SiteMetric site;
  site.x = value[0];
  site.y = value[1];
  site.z = value[2];
  for (int i = 0; i < 9; ++i) site.row[i] = value[3 + i];
  for (int i = 0; i < 3; ++i) site.reach[i] = value[12 + i];
  return site;
}

// All warps walk the rows of bins within reach; all lanes of a warp walk the slots of a row.
__device__ inline void CollectTogether(const LabelTileBody& body,
                                       const LabelTileBody::Search& search,
                                       SharedCandidates& shared) {
  const BinGrid& bins = body.bins;
  const float radius = body.SearchRadius(search);
  const Vec3f& c = search.centre;
  const int32_t low_x = bins.CoordinateOf(c.x - radius, bins.count_x);
  const int32_t high_x = bins.CoordinateOf(c.x + radius, bins.count_x);
  const int32_t low_y = bins.CoordinateOf(c.y - radius, bins.count_y);
  const int32_t row_count_y = bins.CoordinateOf(c.y + radius, bins.count_y) - low_y + 1;
  const int32_t low_z = bins.CoordinateOf(c.z - radius, bins.count_z);
  const int32_t row_count_z = bins.CoordinateOf(c.z + radius, bins.count_z) - low_z + 1;
  const int warp = threadIdx.x / kWarpWidth;
  const int lane = threadIdx.x % kWarpWidth;
  for (int32_t row = warp; row < row_count_y * row_count_z; row += kTileBlocks) {
    const int32_t y = low_y + row % row_count_y;
    const int32_t z = low_z + row / row_count_y;
    const int64_t begin = bins.starts[bins.BinAt(low_x, y, z)];
    const int64_t end = bins.starts[bins.BinAt(high_x, y, z) + 1];
    for (int64_t slot = begin + lane; slot < end; slot += kWarpWidth) {
      if (!body.IsWithinReach(search, body.metric[slot])) continue;
      const int32_t place = atomicAdd(&shared.found, 1);
      if (place < kCandidateCapacity) shared.slot[place] = static_cast<int32_t>(slot);
    }
  }
}

__device__ inline void LoadTogether(const LabelTileBody& body, int count,
                                    SharedCandidates& shared) {
  for (int k = threadIdx.x; k < count; k += kTileThreads) {
    const int32_t slot = shared.slot[k];
    const SiteMetric& site = body.metric[slot];
    float* value = shared.value[k];
    value[0] = site.x;
    value[1] = site.y;
    value[2] = site.z;
    for (int i = 0; i < 9; ++i) value[3 + i] = site.row[i];
    for (int i = 0; i < 3; ++i) value[12 + i] = site.reach[i];
    shared.id[k] = body.bins.ids[slot];
  }
}

// The smallest upper bound over the warp's own block; the same value in every lane.
__device__ inline float BoundBlock(const SharedCandidates& shared, int count, const Vec3f& centre,
                                   float half_width) {
  float bound = kUnboundedReach;
  for (int k = threadIdx.x % kWarpWidth; k < count; k += kWarpWidth) {
    bound = Smaller(bound, BoundsOverCube(CandidateAt(shared, k), centre, half_width).upper);
  }
  for (int step = kWarpWidth / 2; step > 0; step /= 2) {
    bound = Smaller(bound, __shfl_xor_sync(kWholeWarp, bound, step));
  }
  return bound;
}

// Gathers the tile's candidates as LabelTileBody::Gather does. Returns how many, or -1 if they do
// not fit. Every thread of the block calls it and gets the same answer.
__device__ inline int GatherTogether(const LabelTileBody& body, LabelTileBody::Search& search,
                                     const Vec3f& block_centre, SharedCandidates& shared) {
  const int warp = threadIdx.x / kWarpWidth;
  const float block_half_width = static_cast<float>(body.BlockHalfWidth());
  search.reach = kFirstReach;
  while (true) {
    __syncthreads();
    if (threadIdx.x == 0) shared.found = 0;
    __syncthreads();
    CollectTogether(body, search, shared);
    __syncthreads();
    const int found = shared.found;
    const int count = Smaller(found, kCandidateCapacity);
    LoadTogether(body, count, shared);
    __syncthreads();
    const float own =
        Smaller(BoundBlock(shared, count, block_centre, block_half_width), search.limit);
    if (threadIdx.x % kWarpWidth == 0) shared.block_bound[warp] = own;
    __syncthreads();
    float bound = 0;
    for (int block = 0; block < kTileBlocks; ++block) {
      bound = Larger(bound, shared.block_bound[block]);
    }
    const float needed = body.ReachOf(bound);
    if (needed <= search.reach || body.HasSeenAll(search)) {
      return found <= kCandidateCapacity ? count : -1;
    }
    search.reach = bound < kUnboundedReach ? needed : 2 * search.reach;
  }
}

// The owner of the lane's point among the candidates, or kNoOwner.
__device__ inline int32_t OwnerOfPoint(const SharedCandidates& shared, int count,
                                       const Vec3f& block_centre, float half_width, float bound,
                                       const Vec3f& position, float limit) {
  float nearest = limit;
  int32_t owner = kNoOwner;
  for (int first = 0; first < count; first += kWarpWidth) {
    const int own = first + static_cast<int>(threadIdx.x % kWarpWidth);
    const bool is_near =
        own < count &&
        BoundsOverCube(CandidateAt(shared, own), block_centre, half_width).lower <= bound;
    for (unsigned left = __ballot_sync(kWholeWarp, is_near); left != 0; left &= left - 1) {
      const int k = first + __ffs(static_cast<int>(left)) - 1;
      const float distance = ChebyshevDistance(CandidateAt(shared, k), position);
      const int32_t id = shared.id[k];
      if (distance < nearest || (distance == nearest && owner != kNoOwner && id < owner)) {
        nearest = distance;
        owner = id;
      }
    }
  }
  return owner;
}

// Adds the points of every owner in the warp to its cell: one lane per owner.
__device__ inline void AssignTogether(const LabelTileBody& body, int32_t owner,
                                      const LatticePoint& base) {
  const int lane = threadIdx.x % kWarpWidth;
  unsigned left = __ballot_sync(kWholeWarp, owner != kNoOwner);
  while (left != 0) {
    const int leader = __ffs(static_cast<int>(left)) - 1;
    const int32_t site = __shfl_sync(kWholeWarp, owner, leader);
    const unsigned owned = __ballot_sync(kWholeWarp, owner == site);
    if (lane == leader) {
      AddFirstMoments(owned, base, body.moments[site]);
      if (body.wants_second_moments) AddSecondMoments(owned, base, body.moments[site]);
    }
    left &= ~owned;
  }
}

__global__ void __launch_bounds__(kTileThreads) LabelTilesKernel(LabelTileBody body) {
  __shared__ SharedCandidates shared;
  const LabelItem item = body.items[blockIdx.x];
  LabelTileBody::Search search = body.Begin(item);
  const int block = threadIdx.x / kWarpWidth;
  const int lane = threadIdx.x % kWarpWidth;
  const LatticePoint base = body.BlockBase(search, block);
  const Vec3f block_centre = body.CentreOf(base, body.BlockHalfWidth());
  const int count = GatherTogether(body, search, block_centre, shared);
  const unsigned points = body.PointsOf(item, block);

  // No barrier below: warps go their own ways.
  int32_t owner = kNoOwner;
  if (points != 0) {
    const LatticePoint q = PointInBlock(lane);
    const Vec3f position =
        ToFloat(body.barrier.lattice.PositionOf({base.x + q.x, base.y + q.y, base.z + q.z}));
    if (count >= 0) {
      owner = OwnerOfPoint(shared, count, block_centre, static_cast<float>(body.BlockHalfWidth()),
                           shared.block_bound[block] + kCullSlack, position, search.limit);
    } else {
      owner = body.OwnerByScan(search, position);
    }
    if (((points >> lane) & 1u) == 0) owner = kNoOwner;
    AssignTogether(body, owner, base);
  }
  if (!body.labels.empty()) {
    body.labels[static_cast<int64_t>(blockIdx.x) * kTilePoints + threadIdx.x] = owner;
  }
}

inline void LabelTiles(CudaExecutor& executor, const LabelTileBody& body, int64_t item_count) {
  if (item_count == 0 || !executor.MayLaunch()) return;
  LabelTilesKernel<<<static_cast<unsigned>(item_count), kTileThreads, 0, executor.stream()>>>(body);
  CheckCuda(cudaGetLastError(), "label lattice points");
}

}  // namespace amhex
