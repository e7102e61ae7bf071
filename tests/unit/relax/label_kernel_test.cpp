// The device's labelling, run in lockstep on the host, against the body that the CPU runs.
#include <gtest/gtest.h>

#include <ostream>
#include <string>
#include <vector>

#include "base/array_view_of.h"
#include "fixtures/solids.h"
#include "support/lockstep.h"
// After lockstep.h, which gives CUDA's words a meaning on the host.
#include "relax/label_kernel.cuh"
#include "unit/relax/diagram.h"

namespace amhex {
namespace {

using lockstep::Order;

void LabelInLockstep(Diagram& diagram, int tiles_per_group, Order order, int32_t stop_flag = 0) {
  const std::vector<LabelGroup> groups =
      BundleLabelItems(diagram.barrier.lattice, diagram.items, tiles_per_group);
  diagram.LabelBy([&](const LabelTileBody& body) {
    lockstep::Launch(static_cast<int64_t>(groups.size()), kGroupThreads, order, [&] {
      if (tiles_per_group == 1) {
        LabelGroupsKernel<1>(body, ArrayViewOf(groups), &stop_flag);
      } else {
        LabelGroupsKernel<kTileBlocks>(body, ArrayViewOf(groups), &stop_flag);
      }
    });
  });
}

struct LabelKernelCase {
  const char* name;
  TriangleMesh solid;
  double points_per_site;
  int site_count;
  float size_spread;
};

void PrintTo(const LabelKernelCase& c, std::ostream* out) { *out << c.name; }

class LabelKernel : public testing::TestWithParam<LabelKernelCase> {
 protected:
  void SetUp() override {
#if defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "the thread sanitizer does not follow fibers";
#endif
  }
};

TEST_P(LabelKernel, GivesTheSameBitsAsTheBodyInAnyOrderOfLanes) {
  const LabelKernelCase& c = GetParam();
  Diagram diagram = DiagramIn(c.solid, c.points_per_site);
  AddRandomSites(diagram, 11, c.site_count, c.size_spread);
  diagram.Label();
  const std::vector<int32_t> labels = diagram.labels;
  const std::vector<CellMoments> moments = diagram.moments;
  for (const int tiles_per_group : {1, kGroupTiles}) {
    for (const Order order : {Order::kAscending, Order::kDescending}) {
      LabelInLockstep(diagram, tiles_per_group, order);
      EXPECT_EQ(diagram.labels, labels) << tiles_per_group;
      for (size_t i = 0; i < moments.size(); ++i) {
        const CellMoments &a = diagram.moments[i], &b = moments[i];
        ASSERT_EQ(a.count, b.count) << "site " << i << ", " << tiles_per_group << " tiles";
        EXPECT_TRUE(a.x == b.x && a.y == b.y && a.z == b.z) << i;
        EXPECT_TRUE(a.xx == b.xx && a.yy == b.yy && a.zz == b.zz) << i;
        EXPECT_TRUE(a.xy == b.xy && a.yz == b.yz && a.zx == b.zx) << i;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Diagrams, LabelKernel,
    testing::Values(LabelKernelCase{"Coarse", fixtures::MakeTorus(2, 1, 0.6), 12, 300, 0.0f},
                    LabelKernelCase{"Default", fixtures::MakeSphere(1.2, 0.6), 108, 90, 0.0f},
                    LabelKernelCase{"DifferentSizes", fixtures::MakeSphere(1.2, 0.6), 80, 90, 0.8f},
                    LabelKernelCase{"Fine", fixtures::MakeBox({1, 1, 1}, 1), 512, 30, 0.2f},
                    LabelKernelCase{"Few", fixtures::MakeBox({5, 5, 5}, 2), 20, 4, 0.0f},
                    LabelKernelCase{"Crowded", fixtures::MakeBox({2, 2, 2}, 1), 8, 2000, 0.0f},
                    LabelKernelCase{"Dense", fixtures::MakeBox({2, 2, 2}, 1), 100, 500, 0.0f}),
    [](const auto& instance) { return std::string(instance.param.name); });

TEST(LabelKernelFlag, BlocksLeaveWithoutLabelsOnceItIsSet) {
#if defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the thread sanitizer does not follow fibers";
#endif
  Diagram diagram = DiagramIn(fixtures::MakeBox({2, 2, 2}, 1), 108);
  AddRandomSites(diagram, 3, 60, 0.0f);
  LabelInLockstep(diagram, kGroupTiles, Order::kAscending, 1);
  for (const CellMoments& m : diagram.moments) EXPECT_EQ(m.count, 0);
}

TEST(BundleLabelItems, PutsEveryItemIntoOneGroupOfItsSideAtItsPlace) {
  Diagram diagram = DiagramIn(fixtures::MakeTorus(3, 1.3, 0.6), 40);
  AddRandomSites(diagram, 5, 300, 0.0f);
  for (const int tiles_per_group : {1, kGroupTiles}) {
    std::vector<int> seen(diagram.items.size(), 0);
    for (const LabelGroup& group :
         BundleLabelItems(diagram.barrier.lattice, diagram.items, tiles_per_group)) {
      for (int octant = 0; octant < kGroupTiles; ++octant) {
        if (group.item[octant] == kNoItem) continue;
        const auto index = static_cast<size_t>(group.item[octant]);
        const LatticePoint origin = diagram.barrier.lattice.TileOrigin(diagram.items[index].tile);
        const LatticePoint half = BlockInTile(octant);
        EXPECT_EQ(origin.x, group.base.x + half.x * kTileWidth / kBlockWidth);
        EXPECT_EQ(origin.y, group.base.y + half.y * kTileWidth / kBlockWidth);
        EXPECT_EQ(origin.z, group.base.z + half.z * kTileWidth / kBlockWidth);
        EXPECT_EQ(diagram.items[index].is_inside, group.is_inside);
        ++seen[index];
      }
    }
    EXPECT_EQ(seen, std::vector<int>(diagram.items.size(), 1));
  }
}

}  // namespace
}  // namespace amhex
