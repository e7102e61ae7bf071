// How the labelling is laid out on a device, and what the threads of a block share.
#pragma once

#include <cstdint>

#include "relax/label_gather.cuh"

namespace amhex {

// How the work is laid out; which of these suits a lattice: ShapeOf (label_groups.h).
template <int kTilesOfGroup, int kTilesOfThreadBlock, int kBlocksAtOnce, int kCandidates>
struct LabelWork {
  static constexpr int kTiles = kTilesOfGroup;
  static constexpr int kWarps = kTilesOfThreadBlock;
  static constexpr int kParts = kTiles / kWarps;  // thread blocks that share a group
  static constexpr int kThreads = kWarps * kWarpWidth;
  // A lane keeps the owners of its points of so many blocks of the tile; so many candidates are
  // then bounded over them at a time, and kept in so many rounds.
  static constexpr int kAtOnce = kBlocksAtOnce;
  static constexpr int kOfRound = kWarpWidth / kAtOnce;
  static constexpr int kRounds = 4;
  static constexpr int kOfChunk = kRounds * kOfRound;
  static constexpr int kMost = kCandidates;  // of the group
  // Whether candidates are found beforehand and read into shared memory: pays where several tiles
  // look at them.
  static constexpr bool kIsStaged = kTiles > 1;
};
using FineLabelWork = LabelWork<kGroupTiles, 4, kTileBlocks, kFineCapacity>;
using MediumLabelWork = LabelWork<1, 1, kTileBlocks / 2, kMediumCapacity>;
using CoarseLabelWork = LabelWork<1, 1, kTileBlocks / 2, kCoarseCapacity>;

// As many warps as hide what each waits for, with 64 registers per thread.
template <class Work>
inline constexpr int kBlocksPerMultiprocessor = Smaller(kMostWarps / Work::kWarps,
                                                        kMostThreadBlocks);

struct alignas(16) FourFloats {
  float a, b, c, d;
};

// 20 words: read as five 16-byte words, neighbouring candidates lie in different banks.
struct SharedCandidate {
  FourFloats word[4];  // those of SiteMetric
  int32_t id;
  int32_t unused[3];

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
};

// How far the centre of a block is from a candidate: what the distances of its points start from.
// And the lower bound over the block.
struct alignas(16) CentreDistance {
  float a, b, c;
  float lower;
};

template <class Work>
struct LabelMemory {
  SharedCandidate candidate[Work::kIsStaged ? Work::kMost : 1];  // ascending ids
  CentreDistance from_centre[Work::kWarps][Work::kOfChunk * Work::kAtOnce];
  // The tile's candidates by ascending ids: their places above, or where these are not read at
  // once, their slots in the bins.
  int32_t listed[Work::kWarps][Work::kMost];
  GatheredSites<Work::kIsStaged ? 1 : Work::kMost> gathered;
  int32_t is_stopped;

  __device__ SiteMetric Metric(const LabelTileBody& body, int32_t listed_as) const {
    return Work::kIsStaged ? candidate[listed_as].Metric() : body.metric[listed_as];
  }
  __device__ int32_t Id(const LabelTileBody& body, int32_t listed_as) const {
    return Work::kIsStaged ? candidate[listed_as].id : body.bins.ids[listed_as];
  }
};

// What a warp knows of its tile.
struct TileOfWarp {
  LatticePoint base;
  Vec3f centre;
  int32_t item = kNoItem;
  int32_t mask = -1;  // of its points, as LabelItem's
  int32_t is_inside = 0;
  float limit = 0;  // owners are nearer than this, in cell sizes

  __device__ uint32_t Points(const LabelTileBody& body, int block) const {
    return body.PointsOf({0, is_inside, mask}, block);
  }
};

__device__ inline TileOfWarp TileOf(const LabelGroup& group, int octant) {
  TileOfWarp tile;
  tile.item = group.item[octant];
  tile.mask = group.mask[octant];
  tile.is_inside = group.is_inside;
  const LatticePoint offset = TileInGroup(octant);
  tile.base = {group.base.x + offset.x, group.base.y + offset.y, group.base.z + offset.z};
  tile.centre = CentreOfCube(tile.base, kTileHalfWidth);
  tile.limit = group.is_inside != 0 ? kUnboundedReach : kOutsideReach;
  return tile;
}

// The centre of a block, whole numbers and halves: exact.
__device__ inline Vec3f CentreOfBlock(const TileOfWarp& tile, int block) {
  constexpr float kStep = 0.5f * kBlockWidth;
  return {tile.centre.x + ((block & 1) != 0 ? kStep : -kStep),
          tile.centre.y + ((block & 2) != 0 ? kStep : -kStep),
          tile.centre.z + ((block & 4) != 0 ? kStep : -kStep)};
}

// All threads read the group's candidates, a word of 16 bytes each.
template <class Work>
__device__ inline void StageCandidates(const LabelTileBody& body, const int32_t* slots, int count,
                                       LabelMemory<Work>& shared) {
  constexpr int kWords = 4;
  const auto* const words = reinterpret_cast<const FourFloats*>(body.metric.data);
  AMHEX_ROLLED
  for (int i = static_cast<int>(threadIdx.x); i < count * kWords; i += Work::kThreads) {
    const int32_t slot = slots[i / kWords];
    SharedCandidate& candidate = shared.candidate[i / kWords];
    candidate.word[i % kWords] = words[int64_t{slot} * kWords + i % kWords];
    if (i % kWords == 0) candidate.id = body.bins.ids[slot];
  }
}

}  // namespace amhex
