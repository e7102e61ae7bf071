// The search for neighbours on a CUDA device: a warp for every node. Its lanes look at the nodes of
// the bins around and give the nearest of those that are left one after the other.
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
  static_assert(Team::kWidth == 32, "a lane has a row of bins, and one result");

  __device__ NearestTogether(const KnnExactBody& search, int64_t node)
      : search_(search), node_(node), centre_(search.position[node]) {}

  // What the body writes, to the bit. All lanes of the warp come here.
  __device__ void Run() {
    const int listed = ListNodes();
    if (listed > kMostListed || !ChooseAmong(listed)) {
      if (team_.rank() == 0) search_(node_);
    }
  }

 private:
  // Bins beside the node's own, to each side: where there is about one node in each the 26th is 1.8
  // away.
  static constexpr int kShells = 2;
  static constexpr int kRows = (2 * kShells + 1) * (2 * kShells + 1);
  static constexpr int kOfLane = 4;
  static constexpr int kMostListed = kOfLane * Team::kWidth;
  static constexpr uint32_t kNothing = 0xffffffffu;  // above the bits of any distance

  struct Offer {
    uint32_t distance = kNothing;  // squared, its bits: they ascend with it
    uint32_t id = kNothing;
    __device__ bool Precedes(const Offer& other) const {
      return distance < other.distance || (distance == other.distance && id < other.id);
    }
  };

  __device__ static int32_t* List() {
    __shared__ int32_t lists[kSearchThreads / Team::kWidth][kMostListed];
    return lists[threadIdx.x / Team::kWidth];
  }

  // Nodes of the bins around, one row of bins per lane. Returns how many there are; the list holds
  // them if it has room for all.
  __device__ int ListNodes() const {
    const BinGrid& grid = search_.grid;
    const int row = team_.rank();
    const int32_t x = grid.CoordinateOf(centre_.x, grid.count_x);
    const int32_t y =
        grid.CoordinateOf(centre_.y, grid.count_y) + row % (2 * kShells + 1) - kShells;
    const int32_t z =
        grid.CoordinateOf(centre_.z, grid.count_z) + row / (2 * kShells + 1) - kShells;
    int64_t begin = 0, end = 0;
    if (row < kRows && y >= 0 && y < grid.count_y && z >= 0 && z < grid.count_z) {
      begin = grid.starts[grid.BinAt(Larger(x - kShells, 0), y, z)];
      end = grid.starts[grid.BinAt(Smaller(x + kShells, grid.count_x - 1), y, z) + 1];
    }
    const auto own = static_cast<int>(Smaller(end - begin, int64_t{kMostListed} + 1));
    int sum = own;  // of this row and those before
    for (int step = 1; step < Team::kWidth; step *= 2) {
      const int before = team_.From(Larger(row - step, 0), sum);
      if (row >= step) sum += before;
    }
    const int total = team_.From(Team::kWidth - 1, sum);
    team_.Meet();  // nobody reads what was there before
    if (total <= kMostListed) {
      for (int i = 0; i < own; ++i) List()[sum - own + i] = grid.ids[begin + i];
    }
    team_.Meet();
    return total;
  }

  // Writes the nearest of those listed; false if there may be nearer ones elsewhere.
  __device__ bool ChooseAmong(int listed) const {
    Offer offers[kOfLane];
    for (int i = 0; i < kOfLane; ++i) {
      const int place = i * Team::kWidth + team_.rank();
      const int32_t other = place < listed ? List()[place] : static_cast<int32_t>(node_);
      if (other == node_) continue;
      offers[i] = {std::bit_cast<uint32_t>(SquaredDistance(search_.position[other], centre_)),
                   static_cast<uint32_t>(other)};
    }
    Sort(offers);
    Offer own;  // the result of this lane
    for (int slot = 0; slot < kNeighbourCount; ++slot) {
      const Offer& first = offers[0];
      Offer best;
      best.distance = team_.Least(first.distance);
      best.id = team_.Least(first.distance == best.distance ? first.id : kNothing);
      if (best.distance == kNothing) return false;
      if (first.id == best.id) DropFirst(offers);
      if (team_.rank() == slot) own = best;
    }
    const float last = std::bit_cast<float>(team_.From(kNeighbourCount - 1, own.distance));
    if (!EndsWithLastShell(last)) return false;
    if (team_.rank() < kNeighbourCount) {
      search_.neighbours[node_ * kNeighbourCount + team_.rank()] = static_cast<int32_t>(own.id);
    }
    return true;
  }

  // Whether the body, too, looks at all these shells and no more, given its 26th distance. Where it
  // could be a rounding that decides, the body is asked.
  __device__ bool EndsWithLastShell(float squared) const {
    constexpr float kRounding = 1e-5f;
    const float before = static_cast<float>(kShells - 1) * search_.grid.bin_size;
    const float reach = static_cast<float>(kShells) * search_.grid.bin_size;
    return squared > before * before * (1 + kRounding) && squared <= reach * reach;
  }

  // Networks of constant places stay in registers.
  __device__ static void Order(Offer& a, Offer& b) {
    if (!b.Precedes(a)) return;
    const Offer first = b;
    b = a, a = first;
  }
  __device__ static void Sort(Offer (&offers)[kOfLane]) {
    Order(offers[0], offers[1]), Order(offers[2], offers[3]);
    Order(offers[0], offers[2]), Order(offers[1], offers[3]);
    Order(offers[1], offers[2]);
  }
  __device__ static void DropFirst(Offer (&offers)[kOfLane]) {
    offers[0] = offers[1], offers[1] = offers[2], offers[2] = offers[3];
    offers[3] = {};
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
