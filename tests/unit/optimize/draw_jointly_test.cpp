// Laws of drawing places jointly: the slopes are those of the distances, distances fall to what is
// wanted, no cell pays too much for it, and what cannot be followed leaves everything as it was.
#include "optimize/draw_jointly.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <numeric>

#include "optimize/joint_gaps.h"
#include "optimize/raise_quality.h"
#include "output/validate.h"
#include "support/roof.h"

namespace amhex {
namespace {

using testing_support::CubesUnder;
using testing_support::HullUnder;
using testing_support::Roof;

constexpr double kFloor = 0.31;

// Cubes below a ridge, shaken by so much.
struct Scene {
  explicit Scene(const Roof& roof, double shaken = 0)
      : hull(HullUnder(roof)),
        features(hull),
        complex(Shaken(CubesUnder(roof), shaken)),
        placement(PreparePlacement(complex, features)),
        sampling(hull, placement),
        limits(LimitsFor(hull)) {}

  static CellComplex Shaken(CellComplex complex, double amount) {
    testing_support::Shake(complex, amount);
    return complex;
  }
  std::vector<Gap> Gaps() const { return sampling.GapsBeyond(limits.limit, StopPoll()); }
  std::vector<int32_t> AllVertices() const {
    std::vector<int32_t> all(complex.vertices.size());
    std::iota(all.begin(), all.end(), 0);
    return all;
  }

  Hull hull;
  HullFeatures features;
  CellComplex complex;
  Placement placement;
  HullSampling sampling;
  DeviationLimits limits;
};

double SumOfSquares(const std::vector<Gap>& gaps) {
  double sum = 0;
  for (const Gap& gap : gaps) sum += gap.distance * gap.distance;
  return sum;
}

// What is nearest changes with the vertices, but to first order the distance does not.
TEST(JointGaps, RowsHaveTheSlopesOfTheCost) {
  Scene scene({2.4, 0.6}, 0.1);
  JointGaps around(scene.sampling, scene.placement, scene.limits);
  ASSERT_TRUE(around.Enter(scene.AllVertices()));
  std::vector<Vec3d> slope(scene.complex.vertices.size());
  for (const VertexRow& row : around.Rows()) {
    if (row.lack <= 0) continue;
    for (const VertexRow::Slope& part : row.slopes) {
      slope[part.vertex] -= part.fall * (2 * row.lack);
    }
  }
  constexpr double kStep = 1e-6;
  int steep = 0;
  for (size_t v = 0; v < slope.size(); ++v) {
    steep += Norm(slope[v]) > 0.05 ? 1 : 0;
    for (int a = 0; a < 3; ++a) {
      const Vec3d here = scene.complex.vertices[v];
      scene.complex.vertices[v][a] = here[a] + kStep;
      const double above = around.Judge().total();
      scene.complex.vertices[v][a] = here[a] - kStep;
      const double below = around.Judge().total();
      scene.complex.vertices[v] = here;
      EXPECT_NEAR((above - below) / (2 * kStep), slope[v][a], 1e-4) << v << " " << a;
    }
  }
  EXPECT_GT(steep, 5) << "or the test shows nothing";
}

TEST(JointGaps, WeighsWhatIsBeyondTheLimitAsAsked) {
  Scene scene({2.4, 0.6});
  JointGaps around(scene.sampling, scene.placement, scene.limits);
  ASSERT_TRUE(around.Enter(scene.AllVertices()));
  const std::vector<VertexRow> plain = around.Rows(), weighed = around.Rows(4);
  ASSERT_EQ(weighed.size(), plain.size());
  int far = 0;
  for (size_t i = 0; i < plain.size(); ++i) {
    const double weight = weighed[i].lack / plain[i].lack;
    EXPECT_TRUE(weight == 4 || weight == 1) << weight;
    far += weight == 4 ? 1 : 0;
    for (size_t j = 0; j < plain[i].slopes.size(); ++j) {
      const Vec3d expected = plain[i].slopes[j].fall * weight;
      EXPECT_LT(Norm(weighed[i].slopes[j].fall - expected), 1e-12);
    }
  }
  EXPECT_GT(far, 0);
  EXPECT_LT(far, static_cast<int>(plain.size()));
}

TEST(JointGaps, SeesWhatIsFarthest) {
  Scene scene({2.4, 0.6});
  const std::vector<Gap> gaps = scene.Gaps();
  ASSERT_FALSE(gaps.empty());
  JointGaps around(scene.sampling, scene.placement, scene.limits);
  ASSERT_TRUE(around.Enter(scene.AllVertices()));
  const JointDeviation all = around.Judge();
  EXPECT_GE(all.largest, gaps.front().distance - 1e-12);
  EXPECT_LT(all.largest, gaps.front().distance + 0.1);
  EXPECT_GT(all.largest_of_creases, scene.limits.creases);
}

TEST(JointDraw, BringsFacesNearToARidgeBetweenTheirVertices) {
  for (const double ridge_x : {2.4, 2.5, 3.5}) {
    Scene scene({ridge_x, 0.5});
    const std::vector<Gap> before = scene.Gaps();
    ASSERT_FALSE(before.empty());
    JointDraw draw(scene.placement, scene.sampling, scene.limits, kFloor);
    EXPECT_TRUE(draw.Run(before, RunContext())) << ridge_x;
    const std::vector<Gap> after = scene.Gaps();
    EXPECT_LT(SumOfSquares(after), 0.5 * SumOfSquares(before)) << ridge_x;
    if (!after.empty()) EXPECT_LT(after.front().distance, before.front().distance) << ridge_x;
    EXPECT_GE(SummarizeQuality(scene.complex).minimum, kFloor);
    const ValidationReport report = ValidateMesh(testing_support::MeshOf(scene.complex));
    EXPECT_TRUE(report.valid()) << report.Summary();
    const std::vector<Vec3d> start = CubesUnder({ridge_x, 0.5}).vertices;
    for (size_t v = 0; v < start.size(); ++v) {
      EXPECT_TRUE(draw.moved()[v] != 0 || scene.complex.vertices[v] == start[v]);
    }
  }
}

TEST(JointDraw, LeavesTheSamePlacesOnAnyNumberOfThreads) {
  using oneapi::tbb::global_control;
  std::vector<std::vector<Vec3d>> places;
  for (const size_t threads : {1, 4}) {
    const global_control control(global_control::max_allowed_parallelism, threads);
    Scene scene({2.4, 0.5}, 0.1);
    const std::vector<Gap> gaps = scene.Gaps();
    ASSERT_GT(gaps.size(), 4U);
    JointDraw draw(scene.placement, scene.sampling, scene.limits, kFloor);
    EXPECT_TRUE(draw.Run(gaps, RunContext()));
    places.push_back(scene.complex.vertices);
  }
  EXPECT_EQ(places[0], places[1]);
}

TEST(JointDraw, MovesNothingWhereGapsAreEverywhere) {
  Scene scene({2.5, 0.5});
  const std::vector<Vec3d> before = scene.complex.vertices;
  const std::vector<Gap> gaps(scene.complex.hull_faces.size(), scene.Gaps().front());
  JointDraw draw(scene.placement, scene.sampling, scene.limits, kFloor);
  EXPECT_FALSE(draw.Run(gaps, RunContext()));
  EXPECT_EQ(scene.complex.vertices, before);
}

TEST(JointDraw, LeavesVerticesBeforeALostPartWhereTheyAre) {
  Scene scene({2.5, 0.5});
  for (Vec3d& p : scene.complex.vertices) p.z = std::min(p.z, 3.0) / 3;  // two below the hull
  const std::vector<Vec3d> before = scene.complex.vertices;
  const std::vector<Gap> gaps = scene.Gaps();
  ASSERT_FALSE(gaps.empty());
  JointDraw draw(scene.placement, scene.sampling, scene.limits, kFloor);
  EXPECT_FALSE(draw.Run({gaps.front()}, RunContext()));
  EXPECT_EQ(scene.complex.vertices, before);
}

TEST(JointDraw, StopsWhenAsked) {
  Scene scene({2.5, 0.5});
  const std::vector<Vec3d> before = scene.complex.vertices;
  RunContext run;
  run.RequestStop();
  JointDraw draw(scene.placement, scene.sampling, scene.limits, kFloor);
  EXPECT_FALSE(draw.Run(scene.Gaps(), run));
  EXPECT_EQ(scene.complex.vertices, before);
}

}  // namespace
}  // namespace amhex
