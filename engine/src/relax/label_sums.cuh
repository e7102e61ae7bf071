// What the points of a tile add up to for each of their owners.
#pragma once

#include <cstdint>

#include "relax/label_owners.cuh"

namespace amhex {

// Sums over the points of one cell in a tile, relative to the tile's base; two of them side by side
// in a word. Over 256 points of coordinates below 8 each fits into 16 bits.
struct TileSums {
  uint32_t count_z = 0;  // count + (z << 16)
  uint32_t x_y = 0;      // x + (y << 16)
  uint32_t xx_yy = 0, zz_xy = 0, yz_zx = 0;
};
inline constexpr int kHalfWord = 16;
inline constexpr uint32_t kLowHalf = 0xffffu;

__device__ inline uint32_t BothHalves(int low, int high) {
  return static_cast<uint32_t>(low) + (static_cast<uint32_t>(high) << kHalfWord);
}

// What a point of each block adds to the sums, as the lane's point number b of LanePoints.
struct PointSums {
  uint32_t count_z[2];  // by the block's half along z
  uint32_t x_y[4];      // by its place along x and y

  __device__ PointSums() {
    const LatticePoint point = PointInBlock(LaneOfThread());
    AMHEX_UNROLLED
    for (int half = 0; half < 2; ++half) {
      count_z[half] = BothHalves(1, point.z + kBlockWidth * half);
      count_z[half] = NotKnownAhead(count_z[half]);
    }
    AMHEX_UNROLLED
    for (int b = 0; b < 4; ++b) {
      const LatticePoint block = BlockInTile(b);
      x_y[b] = NotKnownAhead(BothHalves(point.x + block.x, point.y + block.y));
    }
  }
};

// Adds up candidate k's points; the speaker gets the sums.
template <class Work>
__device__ inline void AddFirstSums(const LanePoints<Work>& points, const PointSums& of_point,
                                    int first_block, int k, bool is_speaker, TileSums& sums) {
  uint32_t count_z = 0, x_y = 0;
  AMHEX_UNROLLED
  for (int b = 0; b < Work::kAtOnce; ++b) {
    if (points.owner[b] != k) continue;
    count_z += of_point.count_z[b / 4];
    x_y += of_point.x_y[b % 4];
  }
  count_z = SumOfWarp(count_z);
  x_y = SumOfWarp(x_y);
  if (!is_speaker) return;
  // The second half of a tile lies farther along z.
  const auto first_z = static_cast<uint32_t>(BlockInTile(first_block).z);
  sums.count_z = count_z + ((count_z & kLowHalf) * first_z << kHalfWord);
  sums.x_y = x_y;
}

// The same of products of coordinates.
template <class Work>
__device__ inline void AddSecondSums(const LanePoints<Work>& points, int first_block, int k,
                                     bool is_speaker, TileSums& sums) {
  const LatticePoint point = PointInBlock(NotKnownAhead(LaneOfThread()));
  uint32_t xx_yy = 0, zz_xy = 0, yz_zx = 0;
  AMHEX_UNROLLED
  for (int b = 0; b < Work::kAtOnce; ++b) {
    if (points.owner[b] != k) continue;
    const LatticePoint block = BlockInTile(first_block + b);
    const int x = point.x + block.x, y = point.y + block.y, z = point.z + block.z;
    xx_yy += BothHalves(x * x, y * y);
    zz_xy += BothHalves(z * z, x * y);
    yz_zx += BothHalves(y * z, z * x);
  }
  xx_yy = SumOfWarp(xx_yy);
  zz_xy = SumOfWarp(zz_xy);
  yz_zx = SumOfWarp(yz_zx);
  if (!is_speaker) return;
  sums.xx_yy = xx_yy;
  sums.zz_xy = zz_xy;
  sums.yz_zx = yz_zx;
}

// Sends the sums of a tile and a cell to the cell.
__device__ inline void SendSums(const TileSums& sums, const LatticePoint& base, bool wants_second,
                                CellMoments& cell) {
  const int64_t n = sums.count_z & kLowHalf;
  const int64_t x = sums.x_y & kLowHalf, y = sums.x_y >> kHalfWord, z = sums.count_z >> kHalfWord;
  AtomicAdd(&cell.count, n);
  AtomicAdd(&cell.x, n * base.x + x);
  AtomicAdd(&cell.y, n * base.y + y);
  AtomicAdd(&cell.z, n * base.z + z);
  if (!wants_second) return;
  const int64_t xx = sums.xx_yy & kLowHalf, yy = sums.xx_yy >> kHalfWord;
  const int64_t zz = sums.zz_xy & kLowHalf, xy = sums.zz_xy >> kHalfWord;
  const int64_t yz = sums.yz_zx & kLowHalf, zx = sums.yz_zx >> kHalfWord;
  AtomicAdd(&cell.xx, ShiftedProduct(n, base.x, x, base.x, x, xx));
  AtomicAdd(&cell.yy, ShiftedProduct(n, base.y, y, base.y, y, yy));
  AtomicAdd(&cell.zz, ShiftedProduct(n, base.z, z, base.z, z, zz));
  AtomicAdd(&cell.xy, ShiftedProduct(n, base.x, x, base.y, y, xy));
  AtomicAdd(&cell.yz, ShiftedProduct(n, base.y, y, base.z, z, yz));
  AtomicAdd(&cell.zx, ShiftedProduct(n, base.z, z, base.x, x, zx));
}

// Adds up the points of each owner and sends the sums, of a lane's worth of candidates at a time.
template <class Work>
__device__ inline void SendPoints(const LabelTileBody& body, const TileOfWarp& tile,
                                  int first_block, int listed, const LabelMemory<Work>& shared,
                                  const LanePoints<Work>& points) {
  const int lane = LaneOfThread();
  const bool wants_second = body.WantsSecondMoments();
  const PointSums of_point;
  AMHEX_ROLLED
  for (int first = 0; first < listed; first += kWarpWidth) {
    uint32_t own = 0;
    AMHEX_UNROLLED
    for (int b = 0; b < Work::kAtOnce; ++b) {
      own |= OneShifted(static_cast<uint32_t>(points.owner[b] - first));
    }
    own = UnionOfWarp(own);
    TileSums sums;  // of candidate number first + lane
    AMHEX_ROLLED
    for (uint32_t left = own; left != 0; left &= left - 1) {
      const int place = __ffs(static_cast<int>(left)) - 1;
      AddFirstSums<Work>(points, of_point, first_block, first + place, place == lane, sums);
    }
    const bool is_owner = sums.count_z != 0;
    const int32_t site =
        is_owner ? shared.Id(body, shared.listed[WarpOfThread()][first + lane]) : kNoOwner;
    const bool is_split = wants_second && is_owner && body.MayBeSplit(site);
    AMHEX_ROLLED
    for (uint32_t left = __ballot_sync(kWholeWarp, is_split); left != 0; left &= left - 1) {
      const int place = __ffs(static_cast<int>(left)) - 1;
      AddSecondSums<Work>(points, first_block, first + place, place == lane, sums);
    }
    if (is_owner) SendSums(sums, tile.base, is_split, body.moments[site]);
  }
}

}  // namespace amhex
