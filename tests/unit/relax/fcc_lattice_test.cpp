#include "relax/fcc_lattice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <tuple>

#include "base/counter_rng.h"
#include "relax/cell_moments.h"

namespace amhex {
namespace {

TEST(FccLattice, BlocksHoldEveryEvenPointOnce) {
  std::set<std::tuple<int, int, int>> seen;
  for (int p = 0; p < kBlockPoints; ++p) {
    const LatticePoint q = PointInBlock(p);
    EXPECT_EQ((q.x + q.y + q.z) % 2, 0);
    EXPECT_LT(q.x, kBlockWidth);
    EXPECT_EQ(IndexInBlock(q), p);
    seen.insert({q.x, q.y, q.z});
  }
  EXPECT_EQ(seen.size(), static_cast<size_t>(kBlockPoints));
}

TEST(FccLattice, NearestPointIsTheNearestOfAllPoints) {
  const FccLattice lattice{0.4, 1, 1, 1};
  for (uint64_t i = 0; i < 500; ++i) {
    const auto unit = [&](uint64_t axis) {
      return RandomUnit(1, RandomStream::kGridJitter, 3 * i + axis);
    };
    const Vec3d p = Vec3d{unit(0), unit(1), unit(2)} * (7 * lattice.spacing);
    double nearest = 1e300;
    for (int b = 0; b < kTileBlocks; ++b) {
      for (int k = 0; k < kBlockPoints; ++k) {
        const LatticePoint base = BlockInTile(b), q = PointInBlock(k);
        const Vec3d at = lattice.PositionOf({base.x + q.x, base.y + q.y, base.z + q.z});
        nearest = std::fmin(nearest, Norm(at - p));
      }
    }
    const LatticePoint found = lattice.NearestPoint(p);
    EXPECT_EQ((found.x + found.y + found.z) % 2, 0);
    EXPECT_NEAR(Norm(lattice.PositionOf(found) - p), nearest, 1e-12);
  }
}

TEST(FccLattice, NearestPointStaysInTheTiles) {
  const FccLattice lattice{0.5, 1, 1, 1};
  for (const Vec3d& p : {Vec3d{-9, -9, -9}, Vec3d{99, 99, 99}, Vec3d{-1, 99, 2}}) {
    const LatticePoint q = lattice.NearestPoint(p);
    for (const int32_t c : {q.x, q.y, q.z}) {
      EXPECT_GE(c, 0);
      EXPECT_LT(c, kTileWidth);
    }
  }
}

TEST(CellMoments, OfMasksEqualTheSumsOverTheirPoints) {
  for (uint64_t i = 0; i < 100; ++i) {
    const auto owned = static_cast<uint32_t>(RandomBits(1, RandomStream::kGridJitter, i));
    const LatticePoint base = {8 * static_cast<int32_t>(i), 4, 1000};
    CellMoments fast, slow;
    AddFirstMoments(owned, base, fast);
    AddSecondMoments(owned, base, fast);
    for (int p = 0; p < kBlockPoints; ++p) {
      if (((owned >> p) & 1u) == 0) continue;
      const LatticePoint q = PointInBlock(p);
      const int64_t x = base.x + q.x, y = base.y + q.y, z = base.z + q.z;
      ++slow.count;
      slow.x += x, slow.y += y, slow.z += z;
      slow.xx += x * x, slow.yy += y * y, slow.zz += z * z;
      slow.xy += x * y, slow.yz += y * z, slow.zx += z * x;
    }
    EXPECT_EQ(std::tie(fast.count, fast.x, fast.y, fast.z),
              std::tie(slow.count, slow.x, slow.y, slow.z));
    EXPECT_EQ(std::tie(fast.xx, fast.yy, fast.zz, fast.xy, fast.yz, fast.zx),
              std::tie(slow.xx, slow.yy, slow.zz, slow.xy, slow.yz, slow.zx));
  }
}

}  // namespace
}  // namespace amhex
