#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <vector>

#include "fixtures/solids.h"
#include "unit/relax/diagram.h"

namespace amhex {
namespace {

TEST(VoronoiLabels, EqualBruteForceOnRandomSites) {
  Diagram diagram = DiagramIn(fixtures::MakeTorus(3, 1.3, 0.6), 40);
  AddRandomSites(diagram, 1, 700, 0.0f);
  diagram.Label();
  ExpectBruteForceLabels(diagram);
}

TEST(VoronoiLabels, EqualBruteForceForCellsOfDifferentSizes) {
  Diagram diagram = DiagramIn(fixtures::MakeSphere(2.5, 0.6), 100);
  AddRandomSites(diagram, 3, 250, 0.8f);
  diagram.Label();
  ExpectBruteForceLabels(diagram);
}

TEST(VoronoiLabels, EqualBruteForceWhereSitesAreFewOrCrowded) {
  Diagram few = DiagramIn(fixtures::MakeBox({6, 6, 6}, 2), 20);
  AddRandomSites(few, 5, 4, 0.0f);
  few.Label();
  ExpectBruteForceLabels(few);
  // More sites in one tile than the candidate lists hold.
  Diagram crowded = DiagramIn(fixtures::MakeBox({3, 3, 3}, 1), 8);
  AddRandomSites(crowded, 7, 3000, 0.0f);
  crowded.Label();
  ExpectBruteForceLabels(crowded);
}

TEST(VoronoiLabels, EqualBruteForceWhereManySitesAreFar) {
  // All at one end of a beam: from the other one as many as lists hold are far beyond the nearest.
  Diagram far = DiagramIn(fixtures::MakeBox({24, 4, 4}, 1), 20);
  const Vec3d corner = Vec3d{} - far.barrier.origin;
  for (const Vec3f& unit : RandomPoints(11, 700, 1)) {
    far.AddSite(corner + Vec3d{8 * unit.x, 4 * unit.y, 4 * unit.z}, Quatf{}, {1, 1, 1}, true);
  }
  far.items = ListLabelItems(far.barrier, {});
  far.Label();
  ExpectBruteForceLabels(far);
}

TEST(VoronoiLabels, UnderMaximumNormAnAlignedGridGivesCubes) {
  // 108 points per site: a unit cube holds 3 x 3 x 3 cells of the lattice.
  Diagram diagram = DiagramIn(fixtures::MakeBox({4, 4, 4}, 1), 108);
  const Vec3d corner = Vec3d{} - diagram.barrier.origin;
  for (int i = 0; i < 64; ++i) {
    diagram.AddSite(corner + Vec3d{i % 4 + 0.5, i / 4 % 4 + 0.5, i / 16 + 0.5}, Quatf{}, {1, 1, 1},
                    true);
  }
  diagram.items = ListLabelItems(diagram.barrier, {});
  diagram.Label();
  const double spacing = diagram.barrier.lattice.spacing;
  for (size_t i = 0; i < 64; ++i) {
    const CellMoments& m = diagram.moments[i];
    ASSERT_EQ(m.count, 108);
    const Vec3d centroid =
        Vec3d{static_cast<double>(m.x), static_cast<double>(m.y), static_cast<double>(m.z)} *
        (spacing / 108);
    EXPECT_NEAR(Norm(ToFloat(centroid) - diagram.position[i]), 0, 1e-5);
  }
}

TEST(VoronoiLabels, AreTheSameBitsAtEveryVectorWidthOfThisMachine) {
  for (const double points_per_site : {20.0, 108.0, 1000.0}) {
    Diagram diagram = DiagramIn(fixtures::MakeTorus(2, 0.9, 0.6), points_per_site);
    AddRandomSites(diagram, 21, 300, 0.4f);
    const auto label_with = [&](VectorWidth width) {
      diagram.LabelBy([&](const LabelTileBody& body) {
        for (size_t i = 0; i < diagram.items.size(); ++i) {
          body.LabelWith(width, static_cast<int64_t>(i));
        }
      });
      return diagram.labels;
    };
    const std::vector<int32_t> baseline = label_with(VectorWidth::kBaseline);
    if (WidestVectors() != VectorWidth::kBaseline) {
      EXPECT_EQ(label_with(VectorWidth::k256), baseline) << points_per_site;
    }
    if (WidestVectors() == VectorWidth::k512) {
      EXPECT_EQ(label_with(VectorWidth::k512), baseline) << points_per_site;
    }
  }
}

TEST(CellMoments, DoNotDependOnThreadCount) {
  Diagram diagram = DiagramIn(fixtures::MakeTorus(3, 1.3, 0.6), 60);
  AddRandomSites(diagram, 9, 500, 0.5f);
  const auto label_with = [&](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    diagram.Label();
    return diagram.moments;
  };
  const std::vector<CellMoments> one = label_with(1), four = label_with(4);
  for (size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].count, four[i].count);
    EXPECT_EQ(one[i].x, four[i].x);
    EXPECT_EQ(one[i].xx, four[i].xx);
    EXPECT_EQ(one[i].zx, four[i].zx);
  }
}

}  // namespace
}  // namespace amhex
