// The search for neighbours on a CUDA device: a warp for every node. Its lanes look at the nodes of
// the bins around, find how far the 26th is by counting, and rank those that are not farther.
//
// One thread alone keeps its 26 nearest sorted in memory of its own: it waited for that in nine of
// ten cycles.
#pragma once

#include <bit>
#include <cstdint>

#include "exec/cuda_executor.cuh"
#include "exec/team.cuh"
#include "graph/nearest_search.h"

namespace amhex {

inline constexpr int kSearchThreads = 128;

class NearestTogether {
 public:
  static_assert(Team::kWidth == 32 && kNeighbourCount <= Team::kWidth, "a lane ranks one node");

  __device__ NearestTogether(const KnnExactBody& search, int64_t node)
      : search_(search), node_(node), centre_(search.position[node]) {}

  // What the body writes, to the bit. All lanes of the warp come here.
  __device__ void Run() {
    // Where there is about one node in each bin the 26th is 1.8 bins away, mostly below 2; at the
    // rim of all nodes, where half of the bins are empty, 2.3.
    Outcome outcome = LookWithin<2>(2.0f);
    if (outcome == Outcome::kTooFar) {
      outcome = LookWithin<3>(2.5f);
      if (outcome == Outcome::kTooFar) outcome = LookWithin<3>(3.0f);
    } else if (outcome == Outcome::kTooNear) {
      outcome = LookWithin<1>(1.0f);
    }
    if (outcome != Outcome::kDone && team_.rank() == 0) search_(node_);
  }

 private:
  // Whether the 26th is nearer than the body would look, in the last of the shells, or farther.
  enum class Outcome { kDone, kTooNear, kTooFar };

  static constexpr int kOfLane = 4;
  static constexpr int kMostOffered = kOfLane * Team::kWidth;
  static constexpr int kMostListed = 448;  // of three shells with one node in each bin 343
  static constexpr uint32_t kNothing = 0xffffffffu;  // above the bits of any distance

  struct Offer {
    uint32_t distance;  // squared, its bits: they ascend with it
    uint32_t id;
    __device__ bool Precedes(const Offer& other) const {
      return distance < other.distance || (distance == other.distance && id < other.id);
    }
  };
  struct Memory {
    int32_t listed[kMostListed];
    Offer offered[kMostOffered];
  };
  __device__ static Memory& Shared() {
    __shared__ Memory memory[kSearchThreads / Team::kWidth];
    return memory[threadIdx.x / Team::kWidth];
  }

  // Which of the nodes listed are the nearest: all nearer than `distance`, and of those that are as
  // far the ids up to `id`.
  struct Threshold {
    uint32_t distance = 0;
    uint32_t id = kNothing;
    __device__ bool Takes(const Offer& offer) const {
      return offer.distance < distance || (offer.distance == distance && offer.id <= id);
    }
  };

  // Looks at the bins up to so many to each side, at the nodes up to so many bin sizes away; where
  // there are too many the 26th is likely to be nearer.
  template <int kShells>
  __device__ Outcome LookWithin(float radius) {
    const int listed = ListNodes<kShells>();
    if (listed > kMostListed) return Outcome::kTooNear;
    const float reach = radius * search_.grid.bin_size;
    const int offered = OfferNodes(listed, std::bit_cast<uint32_t>(reach * reach));
    if (offered < kNeighbourCount) return Outcome::kTooFar;
    if (offered > kMostOffered) return Outcome::kTooNear;
    Offer offers[kOfLane];
    for (int i = 0; i < kOfLane; ++i) {
      const int place = i * Team::kWidth + team_.rank();
      offers[i] = place < offered ? Shared().offered[place] : Offer{kNothing, kNothing};
    }
    // The body would look at fewer shells if 26 were within the last but one. Where it could be a
    // rounding that decides, it is asked.
    constexpr float kRounding = 1e-5f;
    const float before = static_cast<float>(kShells - 1) * search_.grid.bin_size;
    const uint32_t low = std::bit_cast<uint32_t>(before * before * (1 + kRounding));
    if (CountWithin(offers, low) >= kNeighbourCount) return Outcome::kTooNear;
    WriteRanked(offers,
                FindThreshold(offers, offered, low, std::bit_cast<uint32_t>(reach * reach)));
    return Outcome::kDone;
  }

  // Lists the nodes of the bins around, each row of bins by one lane, if they are not too many.
  // Returns how many there are.
  template <int kShells>
  __device__ int ListNodes() const {
    constexpr int kWidth = 2 * kShells + 1;
    constexpr int kRowsOfLane = (kWidth * kWidth + Team::kWidth - 1) / Team::kWidth;
    const BinGrid& grid = search_.grid;
    const int32_t x = grid.CoordinateOf(centre_.x, grid.count_x);
    const int32_t low_x = Larger(x - kShells, 0);
    const int32_t high_x = Smaller(x + kShells, grid.count_x - 1);
    const int32_t low_y = grid.CoordinateOf(centre_.y, grid.count_y) - kShells;
    const int32_t low_z = grid.CoordinateOf(centre_.z, grid.count_z) - kShells;
    int32_t begin[kRowsOfLane], length[kRowsOfLane];
    int own = 0;
    for (int i = 0; i < kRowsOfLane; ++i) {
      const int row = i * Team::kWidth + team_.rank();
      const int32_t y = low_y + row % kWidth, z = low_z + row / kWidth;
      begin[i] = length[i] = 0;
      if (row >= kWidth * kWidth || y < 0 || y >= grid.count_y || z < 0 || z >= grid.count_z) {
        continue;
      }
      begin[i] = grid.starts[grid.BinAt(low_x, y, z)];
      length[i] = grid.starts[grid.BinAt(high_x, y, z) + 1] - begin[i];
      own += Smaller(length[i], kMostListed + 1);
    }
    int sum = own;  // of this lane and those before
    for (int step = 1; step < Team::kWidth; step *= 2) {
      const int before = team_.From(Larger(team_.rank() - step, 0), sum);
      if (team_.rank() >= step) sum += before;
    }
    const int total = team_.From(Team::kWidth - 1, sum);
    team_.Meet();  // nobody reads what was there before
    if (total <= kMostListed) {
      int32_t* place = Shared().listed + (sum - own);
      for (int i = 0; i < kRowsOfLane; ++i) {
        for (int k = 0; k < length[i]; ++k) *place++ = grid.ids[begin[i] + k];
      }
    }
    team_.Meet();
    return total;
  }

  // Takes those of the nodes listed that are not farther. Returns how many; those above the most
  // are not kept.
  __device__ int OfferNodes(int listed, uint32_t distance) const {
    const unsigned below = (1u << team_.rank()) - 1u;
    int offered = 0;
    for (int first = 0; first < listed; first += Team::kWidth) {
      const int place = first + team_.rank();
      const int32_t other = place < listed ? Shared().listed[place] : static_cast<int32_t>(node_);
      Offer offer{kNothing, static_cast<uint32_t>(other)};
      if (other != node_) {
        offer.distance = std::bit_cast<uint32_t>(SquaredDistance(search_.position[other], centre_));
      }
      const bool is_taken = offer.distance <= distance;
      const unsigned taken = team_.Vote(is_taken);
      const int to = offered + CountBits(taken & below);
      if (is_taken && to < kMostOffered) Shared().offered[to] = offer;
      offered += CountBits(taken);
    }
    team_.Meet();
    return offered;
  }

  // How many offers of all lanes are such.
  template <class Is>
  __device__ int Count(const Offer (&offers)[kOfLane], const Is& is) const {
    int count = 0;
    for (int i = 0; i < kOfLane; ++i) count += CountBits(team_.Vote(is(offers[i])));
    return count;
  }
  __device__ int CountWithin(const Offer (&offers)[kOfLane], uint32_t distance) const {
    return Count(offers, [distance](const Offer& o) { return o.distance <= distance; });
  }

  // Halves the distances in question, of which there are 26 or more within `high` and fewer within
  // `low`, until no more nodes are within than a warp can rank.
  __device__ Threshold FindThreshold(const Offer (&offers)[kOfLane], int within, uint32_t low,
                                     uint32_t high) const {
    while (within > Team::kWidth && high - low > 1) {
      const uint32_t middle = low + (high - low) / 2;
      const int count = CountWithin(offers, middle);
      if (count < kNeighbourCount) {
        low = middle;
      } else {
        high = middle;
        within = count;
      }
    }
    Threshold threshold;
    threshold.distance = high;
    if (within > Team::kWidth) HalveIds(offers, threshold);
    return threshold;
  }

  // The same with the ids of those that are equally far, until the least of them are left that make
  // up the 26.
  __device__ void HalveIds(const Offer (&offers)[kOfLane], Threshold& threshold) const {
    uint32_t low = 0, high = kNothing;
    while (low < high) {
      threshold.id = low + (high - low) / 2;
      const int count = Count(offers, [&threshold](const Offer& o) { return threshold.Takes(o); });
      if (count < kNeighbourCount) {
        low = threshold.id + 1;
      } else {
        high = threshold.id;
      }
    }
    threshold.id = high;
  }

  // Writes the nearest 26 of those within, of which there are no more than lanes, in their order.
  __device__ void WriteRanked(const Offer (&offers)[kOfLane], const Threshold& threshold) const {
    team_.Meet();  // all have read theirs
    Offer* const chosen = Shared().offered;
    const unsigned below = (1u << team_.rank()) - 1u;
    int count = 0;
    for (int i = 0; i < kOfLane; ++i) {
      const bool is_taken = offers[i].distance != kNothing && threshold.Takes(offers[i]);
      const unsigned taken = team_.Vote(is_taken);
      if (is_taken) chosen[count + CountBits(taken & below)] = offers[i];
      count += CountBits(taken);
    }
    team_.Meet();
    if (team_.rank() >= count) return;
    const Offer own = chosen[team_.rank()];
    int rank = 0;
    for (int k = 0; k < count; ++k) rank += chosen[k].Precedes(own) ? 1 : 0;
    if (rank < kNeighbourCount) {
      search_.neighbours[node_ * kNeighbourCount + rank] = static_cast<int32_t>(own.id);
    }
  }

  const KnnExactBody& search_;
  int64_t node_;
  Vec3f centre_;
  Team team_;
};

static __global__ void __launch_bounds__(kSearchThreads, 8)
    FindNearestKernel(ArrayView<const int64_t> count, KnnExactBody search,
                      const int32_t* stop_flag) {
  const Team team;
  const int64_t thread = static_cast<int64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  const int64_t node = thread / Team::kWidth;
  // One thread reads, so that all stay or leave.
  const int goes_on = team.rank() == 0 && node < count[0] && !IsStopSet(stop_flag) ? 1 : 0;
  if (team.From(0, goes_on) != 0) NearestTogether(search, node).Run();
}

template <>
struct NearestSearch<CudaExecutor> {
  static void Run(CudaExecutor& executor, int64_t count, ArrayView<const int64_t> actual_count,
                  const KnnExactBody& body) {
    if (count == 0 || !executor.MayLaunch()) return;
    constexpr int64_t kNodesPerBlock = kSearchThreads / Team::kWidth;
    executor.Launch("find nearest neighbours", FindNearestKernel,
                    (count + kNodesPerBlock - 1) / kNodesPerBlock, kSearchThreads, actual_count,
                    body, executor.stop_flag());
  }
};

}  // namespace amhex
