// The device's labelling, run in lockstep on the host, against the body that the CPU runs.
#include <gtest/gtest.h>

#include <bit>
#include <ostream>
#include <string>
#include <vector>

#include "base/array_view_of.h"
#include "fixtures/solids.h"
#include "support/lockstep.h"
// After lockstep.h, which gives CUDA's words a meaning on the host.
#include "relax/label_gather.cuh"
#include "relax/label_kernel.cuh"
#include "relax/label_rest.cuh"
#include "unit/relax/diagram.h"

namespace amhex {
namespace {

using lockstep::Order;

constexpr LabelShape kShapes[] = {LabelShape::kFine, LabelShape::kMedium, LabelShape::kCoarse};

template <class Work>
void LabelGroups(const LabelTileBody& body, const std::vector<LabelGroup>& groups,
                 const GroupLists& lists, Order order, const int32_t* stop_flag) {
  lockstep::Launch(static_cast<int64_t>(groups.size()) * Work::kParts, Work::kThreads, order,
                   [&] { LabelGroupsKernel<Work>(body, ArrayViewOf(groups), lists, stop_flag); });
}

// `needed_last` is how far the search had to reach last time; 0 the first time.
void LabelInLockstep(Diagram& diagram, LabelShape shape, Order order, int32_t stop_flag = 0,
                     float needed_last = 0) {
  const auto next_reach = std::bit_cast<uint32_t>(needed_last);
  const int tiles = TilesPerGroup(shape);
  const std::vector<LabelGroup> groups =
      BundleLabelItems(diagram.barrier.lattice, diagram.items, tiles);
  const auto count = static_cast<int64_t>(groups.size());
  std::vector<int32_t> slots(groups.size() * kFineCapacity), counts(groups.size());
  std::vector<float> reaches(groups.size());
  std::vector<uint32_t> next_reaches(groups.size(), next_reach), left(groups.size());
  const GroupLists lists = {{slots.data(), count * kFineCapacity},
                            {counts.data(), count},
                            {reaches.data(), count},
                            {next_reaches.data(), count},
                            {left.data(), count}};
  diagram.LabelBy([&](const LabelTileBody& body) {
    switch (shape) {
      case LabelShape::kFine:
        lockstep::Launch((count + kGatherWarps - 1) / kGatherWarps, kGatherThreads, order,
                         [&] { GatherSitesKernel(body, ArrayViewOf(groups), lists, &stop_flag); });
        LabelGroups<FineLabelWork>(body, groups, lists, order, &stop_flag);
        break;
      case LabelShape::kMedium:
        LabelGroups<MediumLabelWork>(body, groups, lists, order, &stop_flag);
        break;
      case LabelShape::kCoarse:
        LabelGroups<CoarseLabelWork>(body, groups, lists, order, &stop_flag);
        break;
    }
    lockstep::Launch((count + kGroupsOfRestBlock - 1) / kGroupsOfRestBlock, kRestThreads, order,
                     [&] { LabelRestKernel(body, ArrayViewOf(groups), tiles, lists, &stop_flag); });
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
  const auto expect_the_same = [&](LabelShape shape) {
    EXPECT_EQ(diagram.labels, labels) << static_cast<int>(shape);
    for (size_t i = 0; i < moments.size(); ++i) {
      const CellMoments &a = diagram.moments[i], &b = moments[i];
      ASSERT_EQ(a.count, b.count) << "site " << i << ", shape " << static_cast<int>(shape);
      EXPECT_TRUE(a.x == b.x && a.y == b.y && a.z == b.z) << i;
      EXPECT_TRUE(a.xx == b.xx && a.yy == b.yy && a.zz == b.zz) << i;
      EXPECT_TRUE(a.xy == b.xy && a.yz == b.yz && a.zx == b.zx) << i;
    }
  };
  // Both long enough and so short that most tiles have to search again.
  constexpr float kTooShort = 0.4f;
  for (const LabelShape shape : kShapes) {
    LabelInLockstep(diagram, shape, Order::kAscending);
    expect_the_same(shape);
    LabelInLockstep(diagram, shape, Order::kDescending);
    expect_the_same(shape);
    LabelInLockstep(diagram, shape, Order::kAscending, 0, kTooShort);
    expect_the_same(shape);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Diagrams, LabelKernel,
    testing::Values(LabelKernelCase{"Coarse", fixtures::MakeTorus(2, 1, 0.6), 12, 300, 0.0f},
                    LabelKernelCase{"Default", fixtures::MakeSphere(1.2, 0.6), 108, 90, 0.0f},
                    LabelKernelCase{"DifferentSizes", fixtures::MakeSphere(1.2, 0.6), 80, 90, 0.8f},
                    LabelKernelCase{"Fine", fixtures::MakeBox({1, 1, 1}, 1), 512, 30, 0.2f},
                    LabelKernelCase{"Paper", fixtures::MakeSphere(1.1, 0.6), 1728, 40, 0.2f},
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
  LabelInLockstep(diagram, LabelShape::kFine, Order::kAscending, 1);
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
