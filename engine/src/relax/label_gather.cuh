// Which sites may own points of a group of tiles: a warp finds them for each group. Where groups
// have several tiles that comes before the points are labelled (label_kernel.cuh), so that no warp
// there waits while others search.
//
// Exact: a site is left out when even its lower bound over the group lies above what the owners'
// distances can be, given that the group's tiles have sites within reach. Whether they have is seen
// when their points are labelled; how far the search has to reach hardly changes from one labelling
// to the next.
#pragma once

#include <cstdint>

#include "relax/label_warp.cuh"

namespace amhex {

inline constexpr int kGatherThreads = 128;
inline constexpr int kGatherWarps = kGatherThreads / kWarpWidth;
// Lanes that walk a row of bins together: a row within reach holds about as many sites.
inline constexpr int kRowLanes = 8;
inline constexpr int kRowsAtOnce = kWarpWidth / kRowLanes;
// Ids that are compared with a lane's own between two branches.
inline constexpr int kIdsAtOnce = 4;
inline constexpr int32_t kBeyondAllIds = INT32_MAX;

// How far the owners of a tile's points are at first, nearly always: the nearest site is within so
// many cell sizes of the centre, and distances grow so fast on the way to the corners.
inline constexpr float kTypicalDistance = 0.6f;
// Later the search reaches so much farther than was needed last, as sites move.
inline constexpr float kReachMargin = 1.06f;

template <int kMost>
struct GatheredSites {
  int32_t slot[kMost];
  int32_t id[kMost + kIdsAtOnce];
};

// Lower bounds over the group above this are those of no owner, if its points turn out to have
// owners within reach (ReachOf). Once all bins are searched every site counts.
__device__ inline float OwnerLimit(const LabelTileBody& body, const LabelTileBody::Search& search) {
  const float limit = body.HasSeenAll(search) ? kUnboundedReach : search.reach / kSquareRootOfThree;
  return Smaller(limit, search.limit + kCullSlack);
}

// Calls visit(slot, is_there) for the sites within reach of the search's cube, a lane for each; all
// lanes come to every call, some with no site.
template <class Visit>
__device__ inline void VisitSitesTogether(const LabelTileBody& body,
                                          const LabelTileBody::Search& search, const Visit& visit) {
  const BinGrid& bins = body.bins;
  const float radius = body.SearchRadius(search);
  const Vec3f centre = search.centre * body.Spacing();
  const int32_t low_x = bins.CoordinateOf(centre.x - radius, bins.count_x);
  const int32_t high_x = bins.CoordinateOf(centre.x + radius, bins.count_x);
  const int32_t low_y = bins.CoordinateOf(centre.y - radius, bins.count_y);
  const int32_t rows_y = bins.CoordinateOf(centre.y + radius, bins.count_y) - low_y + 1;
  const int32_t low_z = bins.CoordinateOf(centre.z - radius, bins.count_z);
  const int32_t high_z = bins.CoordinateOf(centre.z + radius, bins.count_z);
  const int lane = LaneOfThread();
  // The lane's row: y within the rows of a layer, z the layer.
  int32_t y = lane / kRowLanes, z = low_z;
  for (; y >= rows_y; y -= rows_y) ++z;
  struct Row {
    int32_t slot = 0, end = 0;
  };
  const auto row_there = [&] {
    Row row;
    if (z > high_z) return row;
    const int64_t bin = bins.BinAt(low_x, low_y + y, z);
    row.slot = bins.starts[bin] + lane % kRowLanes;
    row.end = bins.starts[bin + (high_x - low_x) + 1];
    return row;
  };
  Row row = row_there();
  AMHEX_ROLLED
  for (int32_t first = 0; first < rows_y * (high_z - low_z + 1); first += kRowsAtOnce) {
    // Read ahead, so that nobody waits for it.
    for (y += kRowsAtOnce; y >= rows_y; y -= rows_y) ++z;
    const Row next = row_there();
    AMHEX_ROLLED
    for (; __ballot_sync(kWholeWarp, row.slot < row.end) != 0; row.slot += kRowLanes) {
      visit(row.slot, row.slot < row.end);
    }
    row = next;
  }
}

// Whether a site of this side may be so near to a point of the search's cube, in cell sizes.
__device__ inline bool MayBeWithin(const LabelTileBody& body, const LabelTileBody::Search& search,
                                   int32_t slot, float limit) {
  const SiteMetric site = body.metric[slot];
  return site.IsOfSide(search.is_inside) &&
         BoundsOverCube(site, search.centre, search.half_width).lower <= limit;
}

// Lists the sites within reach. Returns how many there are; those above the most are not kept.
template <int kMost>
__device__ inline int CollectSites(const LabelTileBody& body, const LabelTileBody::Search& search,
                                   GatheredSites<kMost>& sites) {
  const float limit = OwnerLimit(body, search);
  const unsigned below = (1u << LaneOfThread()) - 1u;
  int found = 0;
  VisitSitesTogether(body, search, [&](int32_t slot, bool is_there) {
    const bool is_near = is_there && MayBeWithin(body, search, slot, limit);
    const unsigned near = __ballot_sync(kWholeWarp, is_near);
    const int place = found + CountBits(near & below);
    if (is_near && place < kMost) {
      sites.slot[place] = slot;
      sites.id[place] = body.bins.ids[slot];
    }
    found += CountBits(near);
  });
  if (LaneOfThread() < kIdsAtOnce && found <= kMost) {
    sites.id[found + LaneOfThread()] = kBeyondAllIds;
  }
  __syncwarp();
  return found;
}

// Writes the slots in the order of the sites' ids, two of each lane at a time.
template <int kMost>
__device__ inline void WriteById(const GatheredSites<kMost>& sites, int count, int32_t* slots) {
  AMHEX_ROLLED
  for (int k = LaneOfThread(); k < count; k += 2 * kWarpWidth) {
    const int second = k + kWarpWidth;
    const int32_t id = sites.id[k], second_id = second < count ? sites.id[second] : 0;
    int rank = 0, second_rank = 0;
    AMHEX_ROLLED
    for (int first = 0; first < count; first += kIdsAtOnce) {
      AMHEX_UNROLLED
      for (int i = 0; i < kIdsAtOnce; ++i) {
        const int32_t other = sites.id[first + i];
        rank += other < id ? 1 : 0;
        second_rank += other < second_id ? 1 : 0;
      }
    }
    slots[rank] = sites.slot[k];
    if (second < count) slots[second_rank] = sites.slot[second];
  }
}

// The reach that will do for the group, most likely; outside of the hull surely.
__device__ inline float LikelyReach(const LabelTileBody& body, const LabelTileBody::Search& search,
                                    uint32_t needed_last) {
  if (search.is_inside == 0) return body.ReachOf(search.limit);
  if (needed_last != 0) return kReachMargin * std::bit_cast<float>(needed_last);
  return body.ReachOf(kTypicalDistance + kSquareRootOfThree * kTileHalfWidth * body.Spacing());
}

// Finds the sites of a group and writes their slots, by ascending ids. Returns how many, or
// kTooMany.
template <int kMost>
__device__ inline int GatherSites(const LabelTileBody& body, LabelTileBody::Search search,
                                  int64_t group, const GroupLists& lists,
                                  GatheredSites<kMost>& sites, int32_t* slots) {
  search.reach = LikelyReach(body, search, lists.next_reach[group]);
  const int found = CollectSites(body, search, sites);
  if (LaneOfThread() == 0) {
    lists.reach[group] = search.reach;
    lists.next_reach[group] = 0;
    lists.left[group] = 0;
  }
  if (found > kMost) return kTooMany;
  WriteById(sites, found, slots);
  return found;
}

// A warp per group. Once the stop flag is set groups are left without sites.
static __global__ void __launch_bounds__(kGatherThreads, kMostWarps / kGatherWarps)
    GatherSitesKernel(LabelTileBody body, ArrayView<const LabelGroup> groups, GroupLists lists,
                      const int32_t* stop_flag) {
  __shared__ GatheredSites<kFineCapacity> gathered[kGatherWarps];
  const int64_t index = static_cast<int64_t>(blockIdx.x) * kGatherWarps + WarpOfThread();
  if (index >= groups.size) return;
  // One lane reads, so that all of the warp stay or leave.
  const int is_stopped = LaneOfThread() == 0 ? *static_cast<const volatile int32_t*>(stop_flag) : 0;
  if (__ballot_sync(kWholeWarp, is_stopped != 0) != 0) {
    if (LaneOfThread() == 0) lists.count[index] = lists.left[index] = 0;
    return;
  }
  const int count = GatherSites(body, SearchOf(groups[index], kGroupTiles), index, lists,
                                gathered[WarpOfThread()], &lists.slots[index * kFineCapacity]);
  if (LaneOfThread() == 0) lists.count[index] = count;
}

}  // namespace amhex
