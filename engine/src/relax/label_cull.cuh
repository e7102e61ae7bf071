// What the threads of one block share while they label a group of tiles, and how they find the
// sites that may own its points: for the group, then for the cube of each warp.
//
// Exact: a site is dropped when even its lower bound over a cube lies above another's upper bound.
// Uses CUDA's own words only, so that the tests can run it on the host.
#pragma once

#include <cstdint>

#include "relax/label_body.h"
#include "relax/label_groups.h"

// Loops of one or two rounds stay rolled: copies would only crowd the instruction cache.
#if defined(__CUDACC__)
#define AMHEX_ROLLED _Pragma("unroll 1")
#define AMHEX_UNROLLED _Pragma("unroll")
#else
#define AMHEX_ROLLED
#define AMHEX_UNROLLED
#endif

namespace amhex {

inline constexpr int kWarpWidth = 32;
inline constexpr unsigned kWholeWarp = 0xffffffffu;
inline constexpr int kGroupThreads = kGroupTiles * kWarpWidth;
static_assert(kBlockPoints == kWarpWidth, "a warp labels a block of the lattice");
static_assert(kGroupTiles == kTileBlocks, "a warp has a tile of the group or a block of the tile");
// As many as hide what each warp waits for, with 64 registers per thread; fewer where shared memory
// has no room for them (64 KB of a multiprocessor at 7.5, 100 KB at 8.6 and 8.9), with more.
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
inline constexpr int kBlocksPerMultiprocessor = 2;
#elif defined(__CUDA_ARCH__) && (__CUDA_ARCH__ == 860 || __CUDA_ARCH__ == 890)
inline constexpr int kBlocksPerMultiprocessor = 3;
#else
inline constexpr int kBlocksPerMultiprocessor = 4;
#endif
// Lanes that walk a row of bins together: a row within reach holds about as many sites.
inline constexpr int kRowLanes = 8;
inline constexpr int kBinRangeEnds = 6;
inline constexpr int kGroupWidth = kGroupWidthInTiles * kTileWidth;

struct alignas(16) FourFloats {
  float a, b, c, d;
};

// Sums over at most 2048 points of coordinates below 16, two of them side by side in a word: each
// fits into 16 bits.
struct FirstSums {
  uint32_t count_z = 0;  // count + (z << 16)
  uint32_t x_y = 0;      // x + (y << 16)
};
inline constexpr int kHalfWord = 16;
inline constexpr uint32_t kLowHalf = 0xffffu;

// 20 words: read as five 16-byte words, neighbouring candidates lie in different banks.
struct SharedCandidate {
  FourFloats word[4];  // row0..3 | row4..7 | row8 x y z | reach0..2, unused
  int32_t id;
  FirstSums sums;
  int32_t unused;

  __device__ SiteMetric Metric() const {
    const FourFloats u = word[0], v = word[1], w = word[2], r = word[3];
    SiteMetric site;
    site.row[0] = u.a, site.row[1] = u.b, site.row[2] = u.c, site.row[3] = u.d;
    site.row[4] = v.a, site.row[5] = v.b, site.row[6] = v.c, site.row[7] = v.d;
    site.row[8] = w.a;
    site.x = w.b, site.y = w.c, site.z = w.d;
    site.reach[0] = r.a, site.reach[1] = r.b, site.reach[2] = r.c;
    return site;
  }
  __device__ void Set(const SiteMetric& site, int32_t site_id) {
    word[0] = {site.row[0], site.row[1], site.row[2], site.row[3]};
    word[1] = {site.row[4], site.row[5], site.row[6], site.row[7]};
    word[2] = {site.row[8], site.x, site.y, site.z};
    word[3] = {site.reach[0], site.reach[1], site.reach[2], 0.0f};
    id = site_id;
    sums = FirstSums{};
  }
};

// How far the centre of a block is from a candidate: what the distances of its points start from.
struct alignas(16) CentreDistance {
  float a, b, c;
  int32_t place;  // of the candidate
};

inline constexpr int kSecondSums = 6;  // xx yy zz xy yz zx

// They fit into 32 bits.
struct SecondSums {
  int32_t sum[kSecondSums];
};

struct GroupMemory {
  SharedCandidate candidate[kCandidateCapacity];
  CentreDistance from_centre[kGroupTiles][kWarpWidth];  // of the round, by lane
  uint8_t warp_list[kGroupTiles][kWarpWidth];           // places of candidates, ascending ids
  SecondSums second[kCandidateCapacity];
  alignas(16) float warp_bound[kGroupTiles];
  LabelTileBody::Search search;
  int32_t bin_range[kBinRangeEnds];  // first and last bin along x, y, z
  int32_t found;                     // may exceed the capacity
  int32_t is_stopped;
};
static_assert(kCandidateCapacity <= 256, "a place in a list has eight bits");

// What one warp knows of its part of the group.
struct WarpCube {
  LatticePoint offset;  // from the group's base
  Vec3f centre;
  float half_width = 0;
  float bound = 0;   // of the owners' distances
  int32_t item = 0;  // or kNoItem: nothing to do
  int first_block = 0;
  // Lower bounds of the lane's first and second candidate: seldom are there more.
  float lower[2] = {};
};

// The centre of the cube of this half width that begins at an offset from the group's base.
__device__ inline Vec3f CentreInGroup(const LatticePoint& base, const LatticePoint& offset,
                                      float half_width) {
  return CentreOfCube({base.x + offset.x, base.y + offset.y, base.z + offset.z}, half_width);
}

// Of `lanes` lanes, a power of two. Unrolled: to ask oneself takes less than to branch.
__device__ inline float SmallestInGroup(float value, int lanes) {
  AMHEX_UNROLLED
  for (int step = kWarpWidth / 2; step > 0; step /= 2) {
    value = Smaller(value, __shfl_xor_sync(kWholeWarp, value, step & (lanes - 1)));
  }
  return value;
}

// The least power of two that is not below a number from 0 to 32.
__device__ inline int PowerNotBelow(int number) {
  return number <= 1 ? 0 : kWarpWidth - __clz(number - 1);
}

// Lower bounds over the group above this are those of no owner, if its points turn out to have
// owners within reach (ReachOf). Once all bins are searched every site counts.
__device__ inline float OwnerLimit(const LabelTileBody& body, const LabelTileBody::Search& search) {
  return body.HasSeenAll(search) ? kUnboundedReach : search.reach / kSquareRootOfThree;
}

// The bins within reach; one thread per end of an axis works it out for all.
__device__ inline void FindBinsWithinReach(const LabelTileBody& body,
                                           const LabelTileBody::Search& search,
                                           GroupMemory& shared) {
  const int axis = static_cast<int>(threadIdx.x) / 2;
  const float radius = body.SearchRadius(search);
  const float end = threadIdx.x % 2 == 0 ? -radius : radius;
  const int32_t count =
      axis == 0 ? body.bins.count_x : (axis == 1 ? body.bins.count_y : body.bins.count_z);
  shared.bin_range[threadIdx.x] =
      body.bins.CoordinateOf(search.centre[axis] * body.Spacing() + end, count);
}

// Eight lanes per row of bins within reach; returns nothing that depends on the order of finding.
__device__ inline void CollectTogether(const LabelTileBody& body,
                                       const LabelTileBody::Search& search, GroupMemory& shared) {
  const BinGrid& bins = body.bins;
  const float limit = OwnerLimit(body, search);
  const int32_t* range = shared.bin_range;
  const int32_t low_x = range[0], high_x = range[1], low_y = range[2], low_z = range[4];
  const int32_t rows_y = range[3] - low_y + 1, rows_z = range[5] - low_z + 1;
  const int thread = static_cast<int>(threadIdx.x);
  AMHEX_ROLLED
  for (int32_t row = thread / kRowLanes; row < rows_y * rows_z; row += kGroupThreads / kRowLanes) {
    const int32_t y = low_y + row % rows_y;
    const int32_t z = low_z + row / rows_y;
    const int64_t begin = bins.starts[bins.BinAt(low_x, y, z)];
    const int64_t end = bins.starts[bins.BinAt(high_x, y, z) + 1];
    AMHEX_ROLLED
    for (int64_t slot = begin + thread % kRowLanes; slot < end; slot += kRowLanes) {
      const SiteMetric site = body.metric[slot];
      if (site.is_inside != search.is_inside) continue;
      if (BoundsOverCube(site, search.centre, search.half_width).lower > limit) continue;
      const int32_t place = atomicAdd(&shared.found, 1);
      if (place >= kCandidateCapacity) continue;
      shared.candidate[place].Set(site, body.bins.ids[slot]);
    }
  }
}

// The smallest upper bound over the warp's own cube; the same value in every lane. Keeps the first
// lower bounds.
__device__ inline float BoundCube(const GroupMemory& shared, int count, WarpCube& cube) {
  float bound = kUnboundedReach;
  AMHEX_ROLLED
  for (int k = static_cast<int>(threadIdx.x) % kWarpWidth; k < count; k += kWarpWidth) {
    const SiteMetric site = shared.candidate[k].Metric();
    const DistanceBounds bounds = BoundsOverCube(site, cube.centre, cube.half_width);
    bound = Smaller(bound, bounds.upper);
    if (k < kWarpWidth) {
      cube.lower[0] = bounds.lower;
    } else if (k < 2 * kWarpWidth) {
      cube.lower[1] = bounds.lower;
    }
  }
  return SmallestInGroup(bound, kWarpWidth);
}

__device__ inline float LowerBound(const GroupMemory& shared, int k, const WarpCube& cube) {
  if (k < kWarpWidth) return cube.lower[0];
  if (k < 2 * kWarpWidth) return cube.lower[1];
  const SiteMetric site = shared.candidate[k].Metric();
  return BoundsOverCube(site, cube.centre, cube.half_width).lower;
}

// How far the owners of a cube's points are, nearly always: the nearest site is within so many cell
// sizes of the centre, and distances grow so fast on the way to the corners (1 along the site's
// axes, 1.73 across). Too short a reach costs a second search; 1 % of them on jittered sites.
inline constexpr float kTypicalDistance = 0.6f;
inline constexpr float kTypicalGrowth = 1.3f;

// Gathers the group's candidates as LabelTileBody::Gather does a tile's, and bounds the cube of
// every warp. Returns how many, or -1 if they do not fit: the same answer in every thread.
__device__ inline int GatherTogether(const LabelTileBody& body, LabelTileBody::Search& search,
                                     WarpCube& cube, GroupMemory& shared) {
  const int warp = static_cast<int>(threadIdx.x) / kWarpWidth;
  search.reach = body.ReachOf(kTypicalDistance + kTypicalGrowth * cube.half_width * body.Spacing());
  while (true) {
    __syncthreads();
    if (threadIdx.x == 0) shared.found = 0;
    if (threadIdx.x < kBinRangeEnds) FindBinsWithinReach(body, search, shared);
    __syncthreads();
    CollectTogether(body, search, shared);
    __syncthreads();
    const int found = shared.found;
    const int count = Smaller(found, kCandidateCapacity);
    cube.bound =
        cube.item == kNoItem ? 0.0f : Smaller(BoundCube(shared, count, cube), search.limit);
    if (threadIdx.x % kWarpWidth == 0) shared.warp_bound[warp] = cube.bound;
    __syncthreads();
    float bound = 0;
    for (int i = 0; i < kGroupTiles; ++i) bound = Larger(bound, shared.warp_bound[i]);
    const float needed = body.ReachOf(bound);
    if (needed <= search.reach || body.HasSeenAll(search)) {
      return found <= kCandidateCapacity ? count : -1;
    }
    search.reach = bound < kUnboundedReach ? needed : 2 * search.reach;
  }
}

// How many lanes are asked between two branches.
inline constexpr int kRankStep = 4;
inline constexpr int32_t kBeyondAllIds = INT32_MAX;

// Lists what may own a point of the warp's cube, by id. Returns how many, or -1 if they are more
// than lanes.
__device__ inline int ListForWarp(GroupMemory& shared, int count, const WarpCube& cube) {
  const int warp = static_cast<int>(threadIdx.x) / kWarpWidth;
  const int lane = static_cast<int>(threadIdx.x) % kWarpWidth;
  uint8_t* list = shared.warp_list[warp];
  const unsigned below = (1u << lane) - 1u;
  int listed = 0;
  AMHEX_ROLLED
  for (int first = 0; first < count; first += kWarpWidth) {
    const int k = first + lane;
    const bool is_near = k < count && LowerBound(shared, k, cube) <= cube.bound + kCullSlack;
    const unsigned near = __ballot_sync(kWholeWarp, is_near);
    const int place = listed + CountBits(near & below);
    listed += CountBits(near);
    if (listed > kWarpWidth) return -1;
    if (is_near) list[place] = static_cast<uint8_t>(k);
  }
  __syncwarp();
  const uint8_t own = lane < listed ? list[lane] : uint8_t{0};
  const int32_t own_id = lane < listed ? shared.candidate[own].id : kBeyondAllIds;
  int rank = 0;
  AMHEX_ROLLED
  for (int first = 0; first < listed; first += kRankStep) {
    AMHEX_UNROLLED
    for (int i = 0; i < kRankStep; ++i) {
      rank += __shfl_sync(kWholeWarp, own_id, first + i) < own_id ? 1 : 0;
    }
  }
  __syncwarp();
  if (lane < listed) list[rank] = own;
  __syncwarp();
  return listed;
}

}  // namespace amhex
