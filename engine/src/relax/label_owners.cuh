// Which candidate owns which point of a tile. Candidates are dropped for the tile and for each of
// its blocks, exactly: where even the lower bound lies above another's upper bound.
#pragma once

#include <cstdint>

#include "relax/label_work.cuh"

namespace amhex {

// Bounds the owners' distances over the warp's tile and lists those of the group's sites that may
// own a point of it. Returns how many it has listed, or kTooMany if there may be others that were
// not found. Where candidates are not staged the list holds the slots of all of them before.
template <class Work>
__device__ inline int ListForTile(const LabelTileBody& body, const LabelTileBody::Search& search,
                                  const TileOfWarp& tile, int count, uint32_t* next_reach,
                                  LabelMemory<Work>& shared) {
  const int lane = LaneOfThread();
  int32_t* const list = shared.listed[WarpOfThread()];
  const auto candidate = [&](int k) { return Work::kIsStaged ? k : list[k]; };
  const auto bounds_of = [&](int32_t listed_as) {
    return BoundsOverCube(shared.Metric(body, listed_as), tile.centre, kTileHalfWidth);
  };
  float bound = tile.limit;
  float lowers[2] = {};  // of the lane's first two candidates: seldom are there more
  AMHEX_ROLLED
  for (int k = lane; k < count; k += kWarpWidth) {
    const DistanceBounds bounds = bounds_of(candidate(k));
    bound = Smaller(bound, bounds.upper);
    if (k < kWarpWidth) {
      lowers[0] = bounds.lower;
    } else if (k < 2 * kWarpWidth) {
      lowers[1] = bounds.lower;
    }
  }
  bound = LeastOfWarp(bound);
  const float needed = body.ReachOf(bound);
  if (lane == 0 && bound < kUnboundedReach) {
    atomicMax(next_reach, std::bit_cast<uint32_t>(needed));
  }
  if (needed > search.reach && !body.HasSeenAll(search)) return kTooMany;
  bound += kCullSlack;
  const unsigned below = (1u << lane) - 1u;
  int listed = 0;
  AMHEX_ROLLED
  for (int first = 0; first < count; first += kWarpWidth) {
    const int k = first + lane;
    // Read before anybody writes to the same places of the list.
    const int32_t own = k < count ? candidate(k) : 0;
    float lower = first == 0 ? lowers[0] : lowers[1];
    if (first >= 2 * kWarpWidth && k < count) lower = bounds_of(own).lower;
    const bool is_near = k < count && lower <= bound;
    const unsigned near = __ballot_sync(kWholeWarp, is_near);
    const int place = listed + CountBits(near & below);
    listed += CountBits(near);
    if (is_near) list[place] = own;
  }
  __syncwarp();
  return listed;
}

// Bounds the listed candidates `begin` to `end`, a chunk, over the blocks from `first_block` on, a
// lane for each pair of the two, and leaves how far the blocks' centres are in `from_centre`.
// Returns the least upper bound that the lane has seen for its block.
template <class Work>
__device__ inline float BoundChunk(const LabelTileBody& body, const TileOfWarp& tile,
                                   int first_block, int begin, int end, LabelMemory<Work>& shared) {
  const int lane = LaneOfThread(), warp = WarpOfThread();
  const Vec3f centre = CentreOfBlock(tile, first_block + lane % Work::kAtOnce);
  CentreDistance* from_centre = shared.from_centre[warp] + lane;
  float upper = tile.limit;
  AMHEX_ROLLED
  for (int k = begin + lane / Work::kAtOnce; k - lane / Work::kAtOnce < end; k += Work::kOfRound) {
    const SiteMetric site = shared.Metric(body, shared.listed[warp][k < end ? k : begin]);
    const MetricComponents at = ComponentsAt(site, centre);
    const DistanceBounds bounds = BoundsAround(at, site.reach, kBlockHalfWidth);
    *from_centre = {at.a, at.b, at.c, k < end ? bounds.lower : kUnboundedReach};
    from_centre += kWarpWidth;
    upper = Smaller(upper, bounds.upper);
  }
  return upper;
}

// The least of the lanes that have the same block.
template <class Work>
__device__ inline float LeastOfBlock(float value) {
  AMHEX_UNROLLED
  for (int step = Work::kAtOnce; step < kWarpWidth; step *= 2) {
    value = Smaller(value, __shfl_xor_sync(kWholeWarp, value, step));
  }
  return value;
}

// Which blocks candidate number begin + lane may own points of: bit b for block first_block + b.
template <class Work>
__device__ inline unsigned VoteOnChunk(float bound, int begin, int end,
                                       const LabelMemory<Work>& shared) {
  constexpr unsigned kBlocks = (1u << Work::kAtOnce) - 1u;
  const int lane = LaneOfThread();
  const CentreDistance* from_centre = shared.from_centre[WarpOfThread()] + lane;
  unsigned near = 0;
  AMHEX_ROLLED
  for (int first = 0; first < end - begin; first += Work::kOfRound, from_centre += kWarpWidth) {
    const unsigned vote = __ballot_sync(kWholeWarp, from_centre->lower <= bound);
    const int place = lane - first;
    if (place >= 0 && place < Work::kOfRound) near = vote >> (place * Work::kAtOnce) & kBlocks;
  }
  __syncwarp();
  return near;
}

// The lane's points, one of each block that is looked at.
template <class Work>
struct LanePoints {
  int owner[Work::kAtOnce];  // number in the tile's list
  float nearest[Work::kAtOnce];
};

// Gives points to those of the chunk's candidates that are nearer than all before. `near` as of
// VoteOnChunk.
template <class Work>
__device__ inline void FindOwners(const LabelTileBody& body, int begin, int end, unsigned near,
                                  const LabelMemory<Work>& shared, LanePoints<Work>& points) {
  static_assert(Work::kOfChunk <= kWarpWidth, "a lane knows of one candidate of a chunk");
  const int lane = LaneOfThread();
  const CentreDistance* from_centre = shared.from_centre[WarpOfThread()];
  const int32_t own = lane < end - begin ? shared.listed[WarpOfThread()][begin + lane] : 0;
  const Vec3f step = StepFromCentre(lane);
  // Ids ascend: the first of equal distances stays.
  AMHEX_ROLLED
  for (int k = 0; k < end - begin; ++k, from_centre += Work::kAtOnce) {
    // Told by one lane, so that the compiler knows it to be the same in all.
    const unsigned blocks = __shfl_sync(kWholeWarp, near, k);
    const int32_t listed_as = __shfl_sync(kWholeWarp, own, k);
    if (blocks == 0) continue;
    const MetricComponents change = ChangeOf(shared.Metric(body, listed_as).row, step);
    AMHEX_UNROLLED
    for (int b = 0; b < Work::kAtOnce; ++b) {
      if ((blocks >> b & 1u) == 0) continue;
      const CentreDistance centre = from_centre[b];
      const float distance = DistanceBeside({centre.a, centre.b, centre.c}, change);
      if (distance < points.nearest[b]) {
        points.nearest[b] = distance;
        points.owner[b] = begin + k;
      }
    }
  }
}

// Finds the owners of the points of the blocks from `first_block` on.
template <class Work>
__device__ inline LanePoints<Work> LabelBlocks(const LabelTileBody& body, const TileOfWarp& tile,
                                               int first_block, int listed,
                                               LabelMemory<Work>& shared) {
  LanePoints<Work> points;
  AMHEX_UNROLLED
  for (int b = 0; b < Work::kAtOnce; ++b) {
    points.owner[b] = kNoOwner;
    points.nearest[b] = tile.limit;
  }
  float bound = tile.limit;
  AMHEX_ROLLED
  for (int begin = 0; begin < listed; begin += Work::kOfChunk) {
    const int end = Smaller(begin + Work::kOfChunk, listed);
    bound = Smaller(bound, BoundChunk<Work>(body, tile, first_block, begin, end, shared));
  }
  bound = Smaller(LeastOfBlock<Work>(bound) + kCullSlack, tile.limit);
  AMHEX_ROLLED
  for (int begin = 0; begin < listed; begin += Work::kOfChunk) {
    const int end = Smaller(begin + Work::kOfChunk, listed);
    // Of a single chunk they are there.
    if (listed > Work::kOfChunk) BoundChunk<Work>(body, tile, first_block, begin, end, shared);
    const unsigned near = VoteOnChunk<Work>(bound, begin, end, shared);
    FindOwners<Work>(body, begin, end, near, shared, points);
    __syncwarp();
  }
  return points;
}

}  // namespace amhex
