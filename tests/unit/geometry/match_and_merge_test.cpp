#include "geometry/match_and_merge.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <tuple>

#include "fixtures/solids.h"
#include "geometry/cubes.h"
#include "geometry/face_matching.h"
#include "geometry/merge_sets.h"
#include "input/hull_queries.h"
#include "support/hull_of_mesh.h"

namespace amhex {
namespace {

// Unit cubes around the integer points of [0, n)^3, axes as given.
Sites GridSites(int n, double spacing = 1.0) {
  Sites sites;
  for (int z = 0; z < n; ++z) {
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        sites.position.push_back({x * spacing, y * spacing, z * spacing});
        sites.frame.push_back({});
        sites.size.push_back({1, 1, 1});
        sites.cell_volume.push_back(0);
      }
    }
  }
  return sites;
}

FacePair PairOf(const Cubes& cubes, int a, int direction_a, int b, int direction_b) {
  const MatchScore score = ScoreFaces(cubes, a, direction_a, b, direction_b);
  return {score.value,
          a,
          b,
          static_cast<uint8_t>(direction_a),
          static_cast<uint8_t>(direction_b),
          static_cast<uint8_t>(score.rotation)};
}

TEST(MatchScore, BodiesKnowTheCornersOfEveryFace) {
  for (int direction = 0; direction < kDirectionCount; ++direction) {
    for (int q = 0; q < 4; ++q) {
      EXPECT_EQ(CornerOfFace(direction, q), kCubeFaces[direction][q]) << direction << " " << q;
    }
  }
}

TEST(MatchScore, FacingPairsScoreTheirPlainVertexDistance) {
  const Cubes cubes = MaterializeCubes(GridSites(2, 1.25));
  // Cube 1 lies 1.25 to the right of cube 0: each of four corner pairs is 0.25 apart.
  EXPECT_NEAR(ScoreFaces(cubes, 0, 1, 1, 0).value, 4 * 0.25, 1e-12);
}

TEST(MatchScore, PairsOfOneDirectionScoreTwice) {
  const Cubes cubes = MaterializeCubes(GridSites(2));
  // Both look to +x; the corners are one edge apart in the best rotation.
  const double distance = 4 * 1.0;
  EXPECT_GE(ScoreFaces(cubes, 0, 1, 1, 1).value, 2 * distance - 1e-9);
}

TEST(FacePairs, AreAllThatScoreWellAmongCubesOfAnyOrientation) {
  // Turned by up to a quarter about one axis, and shaken.
  Sites sites = GridSites(3, 1.1);
  for (size_t i = 0; i < sites.position.size(); ++i) {
    const double turn = 0.06 * static_cast<double>(i);
    const double c = std::cos(turn), s = std::sin(turn);
    sites.frame[i].axis = {Vec3d{c, s, 0}, Vec3d{-s, c, 0}, Vec3d{0, 0, 1}};
    sites.position[i] += Vec3d{s, c, s * c} * 0.3;
  }
  const Cubes cubes = MaterializeCubes(sites);
  const auto pairs = CollectFacePairs(FaceSearch(cubes, {}).view(), RunContext());
  ASSERT_TRUE(pairs.ok());
  std::set<std::tuple<double, int, int>> found, expected;
  for (const FacePair& pair : *pairs) {
    found.emplace(pair.score, 6 * pair.cube_a + pair.direction_a,
                  6 * pair.cube_b + pair.direction_b);
  }
  for (int a = 0; a < cubes.count(); ++a) {
    for (int b = a + 1; b < cubes.count(); ++b) {
      const Vec3d d = cubes.centre[b] - cubes.centre[a];
      if (Norm(d) > 1.7) continue;
      for (int u = 0; u < 6; ++u) {
        for (int v = 0; v < 6; ++v) {
          const bool are_facing = Dot(cubes.FaceNormal(a, u), d) >= 0.6 * Norm(d) &&
                                  Dot(cubes.FaceNormal(b, v), d) <= -0.6 * Norm(d);
          const double score = ScoreFaces(cubes, a, u, b, v).value / 4;
          if (are_facing && score < 0.8) expected.emplace(score, 6 * a + u, 6 * b + v);
        }
      }
    }
  }
  EXPECT_GT(found.size(), sites.position.size());
  EXPECT_EQ(found, expected);
}

TEST(MergeSets, TwoByTwoByTwoCubesShareOneCentreVertexAndTotalTwentySeven) {
  const Cubes cubes = MaterializeCubes(GridSites(2));
  const MergeSets own(cubes);
  const MergeView& sets = own.view();
  int merged = 0;
  const absl::StatusOr<std::vector<FacePair>> pairs =
      CollectFacePairs(FaceSearch(cubes, {}).view(), RunContext());
  ASSERT_TRUE(pairs.ok());
  for (const FacePair& pair : *pairs) {
    if (pair.score > 1e-9) break;
    ASSERT_TRUE(sets.CanMerge(CornersToMerge(pair), Collapse::kForbidden));
    sets.Merge(CornersToMerge(pair));
    ++merged;
  }
  EXPECT_EQ(merged, 12);
  std::set<int> roots;
  for (int v = 0; v < 8 * cubes.count(); ++v) roots.insert(sets.Find(v));
  EXPECT_EQ(roots.size(), 27u);
  // Corner 6 of cube 0 is the centre; all eight cubes meet there.
  int at_centre = 0;
  for (int v = 0; v < 8 * cubes.count(); ++v) at_centre += sets.Find(v) == sets.Find(6) ? 1 : 0;
  EXPECT_EQ(at_centre, 8);
}

TEST(MergeSets, NeverCollapseADiagonal) {
  const Cubes cubes = MaterializeCubes(GridSites(2));
  const MergeSets own(cubes);
  const MergeView& sets = own.view();
  sets.Merge(CornersToMerge(PairOf(cubes, 0, 1, 1, 0)));
  // Corner 1 of cube 0 is corner 0 of cube 1; joining it with corner 7 of cube 1 would collapse
  // a diagonal of cube 1.
  const CornerPairs diagonal = {{{1, 8 + 7}, {1, 1}, {2, 2}, {5, 5}}};
  EXPECT_FALSE(sets.CanMerge(diagonal, Collapse::kEdgesOnly));
}

TEST(MergeSets, CollapseEdgesOnlyWhenAllowed) {
  const Cubes cubes = MaterializeCubes(GridSites(1));
  const MergeSets own(cubes);
  const MergeView& sets = own.view();
  const CornerPairs edge = {{{0, 1}, {2, 2}, {3, 3}, {4, 4}}};
  EXPECT_FALSE(sets.CanMerge(edge, Collapse::kForbidden));
  EXPECT_TRUE(sets.CanMerge(edge, Collapse::kEdgesOnly));
}

// Blocks of 3 x 3 x 3 unit cubes that many cells apart, and the hull around each.
struct Blocks {
  Sites sites;
  Hull hull;
};
Blocks BlocksApart(double gap) {
  Blocks blocks;
  blocks.sites = GridSites(3);
  Sites other = GridSites(3);
  for (Vec3d& p : other.position) p.x += 3 + gap;
  const auto append = [](auto& all, const auto& more) {
    all.insert(all.end(), more.begin(), more.end());
  };
  append(blocks.sites.position, other.position), append(blocks.sites.frame, other.frame);
  append(blocks.sites.size, other.size), append(blocks.sites.cell_volume, other.cell_volume);
  const TriangleMesh box =
      fixtures::Translated(fixtures::MakeBox({3, 3, 3}, 1), {-0.5, -0.5, -0.5});
  blocks.hull = testing_support::HullOfMesh(
      fixtures::Joined(box, fixtures::Translated(box, {3 + gap, 0, 0})));
  return blocks;
}

TEST(Cubes, AreApartWhereTheWayBetweenThemLeavesTheSolid) {
  const Blocks blocks = BlocksApart(0.5);
  const Cubes cubes = MaterializeCubes(blocks.sites);
  CubesView view = cubes.view();
  EXPECT_FALSE(view.AreApart(0, 27));  // of no hull
  view.hull = blocks.hull.queries->view();
  for (int a = 0; a < cubes.count(); ++a) {
    for (int b = 0; b < cubes.count(); ++b) {
      EXPECT_EQ(view.AreApart(a, b), a != b && (a < 27) != (b < 27)) << a << " " << b;
    }
  }
}

TEST(MatchAndMerge, GluesNothingAcrossAGap) {
  for (const double gap : {0.05, 0.2, 0.5, 0.75}) {
    const Blocks blocks = BlocksApart(gap);
    RunContext run;
    const auto merged = MatchAndMerge(blocks.sites, blocks.hull, {}, run);
    ASSERT_TRUE(merged.ok()) << merged.status();
    EXPECT_EQ(merged->vertices.size(), 2 * 64U) << gap;
    for (size_t i = 0; i < merged->matches.size(); ++i) {
      for (const int32_t face : merged->matches[i]) {
        if (face >= 0) EXPECT_EQ(static_cast<size_t>(face / 6) < 27, i < 27) << gap;
      }
    }
  }
}

TEST(MatchAndMerge, GluesAcrossAsMuchWhereNoHullIsBetween) {
  Blocks blocks = BlocksApart(0.5);
  blocks.hull = testing_support::HullOfMesh(
      fixtures::Translated(fixtures::MakeBox({6.5, 3, 3}, 0.5), {-0.5, -0.5, -0.5}));
  RunContext run;
  const auto merged = MatchAndMerge(blocks.sites, blocks.hull, {}, run);
  ASSERT_TRUE(merged.ok()) << merged.status();
  EXPECT_EQ(merged->vertices.size(), 2 * 64U - 16);
}

}  // namespace
}  // namespace amhex
