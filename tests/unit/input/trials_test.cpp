#include "trials.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <vector>

#include "closure/working_mesh.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"

namespace amhex {
namespace {

using testing_support::GridComplex;

Hull OfVolume(double volume) {
  Hull hull;
  hull.volume = volume;
  return hull;
}

TEST(PlanTrials, TriesMoreOnSmallerSolids) {
  const MeshingParams params;
  const int small = PlanTrials(OfVolume(1e3), params).started.most;
  const int medium = PlanTrials(OfVolume(1e4), params).started.most;
  EXPECT_GT(small, medium);
  EXPECT_GT(medium, 1);
  for (const double large : {5e4, 1e6}) {
    EXPECT_EQ(PlanTrials(OfVolume(large), params).started.usual, 1);
    EXPECT_EQ(CountOfTrials(large, params), 1);
  }
}

TEST(PlanTrials, ClosesOneOfFewButMoreOfSmallSolids) {
  for (const double volume : {5e3, 1.9e4}) {
    const TrialPlan plan = PlanTrials(OfVolume(volume), MeshingParams());
    EXPECT_EQ(plan.started.most, 3);
    EXPECT_EQ(plan.closed, 1);
  }
  EXPECT_EQ(PlanTrials(OfVolume(3e3), MeshingParams()).closed, 2);
}

TEST(PlanTrials, StartsTheLastOfFewWhereTheOthersAreTornOnly) {
  MeshingParams params;
  for (const double volume : {1e4, 5e4}) {
    const TrialPlan plan = PlanTrials(OfVolume(volume), params);
    EXPECT_EQ(plan.started.usual, plan.started.most - 1);
  }
  for (const int asked : {1, 2, 12}) {
    params.sizing.trial_count = asked;
    const TrialPlan plan = PlanTrials(OfVolume(1e4), params);
    EXPECT_EQ(plan.started.usual, plan.started.most);
  }
}

TEST(PlanTrials, IsTheSameForTheNumberThatItStandsFor) {
  for (const double volume : {1e3, 3e3, 1e4, 5e4}) {
    MeshingParams params;
    const TrialPlan usual = PlanTrials(OfVolume(volume), params);
    params.sizing.trial_count = usual.started.most;
    const TrialPlan asked = PlanTrials(OfVolume(volume), params);
    EXPECT_EQ(asked.started.usual, usual.started.usual);
    EXPECT_EQ(asked.started.most, usual.started.most);
    EXPECT_EQ(asked.has_spare, usual.has_spare);
  }
}

TEST(PlanTrials, HasASpareWhereOneIsTheDefault) {
  MeshingParams params;
  EXPECT_TRUE(PlanTrials(OfVolume(5e4), params).has_spare);
  EXPECT_FALSE(PlanTrials(OfVolume(1e4), params).has_spare);
  params.sizing.trial_count = 1;
  EXPECT_FALSE(PlanTrials(OfVolume(5e4), params).has_spare);
  params.sizing.trial_count = 0;
  params.relaxation.initialization = Initialization::kGrid;
  EXPECT_FALSE(PlanTrials(OfVolume(5e4), params).has_spare);
}

TEST(PlanTrials, DoesWhatIsAskedForAtAnySize) {
  MeshingParams params;
  for (const int asked : {1, 2, 12}) {
    params.sizing.trial_count = asked;
    for (const double volume : {1e2, 1e4, 1e6}) {
      const TrialPlan plan = PlanTrials(OfVolume(volume), params);
      EXPECT_EQ(plan.started.most, asked);
      EXPECT_GE(plan.closed, 1);
      EXPECT_LE(plan.closed, plan.started.most);
    }
  }
}

TEST(PlanTrials, HasOnlyOneWithTheGridsOfThePaper) {
  MeshingParams params;
  params.sizing.trial_count = 5;
  params.relaxation.initialization = Initialization::kGrid;
  EXPECT_EQ(PlanTrials(OfVolume(1e3), params).started.most, 1);
}

// A grid of 6 x 6 x 6 cubes without `count` of them in a row, in the middle.
CellComplex GridWithBar(int count) {
  WorkingMesh mesh(GridComplex({6, 6, 6}));
  for (int cell = 86; cell < 86 + count; ++cell) mesh.RemoveCell(cell);
  return mesh.ToComplex();
}

// Three trials closed on `threads`, of which the plan asks for `at_least`.
std::vector<ClosedTrial> CloseThree(int at_least, size_t threads) {
  const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                          threads);
  Hull hull = testing_support::GridHull({6, 6, 6}, 1);
  hull.volume = 216;
  RunContext run;
  auto closed = CloseTrials({GridWithBar(3), GridWithBar(0), GridWithBar(1)}, hull,
                            {.started = {3, 3}, .closed = at_least}, MeshingParams(), run);
  EXPECT_TRUE(closed.ok()) << closed.status();
  return closed.ok() ? std::move(closed->closed) : std::vector<ClosedTrial>();
}

// A grid of 17 x 17 x 17 cubes without `count` of those inside, no two of which touch.
CellComplex GridWithHoles(int count) {
  WorkingMesh mesh(GridComplex({17, 17, 17}));
  for (int i = 0; i < count; ++i) {
    const int x = 1 + 2 * (i % 5), y = 1 + 2 * (i / 5 % 5), z = 1 + 2 * (i / 25);
    mesh.RemoveCell(x + 17 * (y + 17 * z));
  }
  return mesh.ToComplex();
}

TEST(CloseTrials, ClosesAllThatAreLittleWorkBestFirst) {
  const std::vector<ClosedTrial> closed = CloseThree(1, 4);
  ASSERT_EQ(closed.size(), 3U);
  EXPECT_EQ(closed.front().assembly, 1U);
  for (const ClosedTrial& trial : closed) {
    EXPECT_FALSE(WorkingMesh(trial.complex).HasOpenFaces());
  }
}

TEST(CloseTrials, LetsThoseWaitThatAreMuchWorkBesideABetterOne) {
  Hull hull = testing_support::GridHull({17, 17, 17}, 1);
  hull.volume = 17 * 17 * 17;  // more than a few cells
  RunContext run;
  const auto trials = CloseTrials({GridWithHoles(60), GridWithHoles(40), GridWithHoles(50)}, hull,
                                  {.started = {3, 3}, .closed = 1}, MeshingParams(), run);
  ASSERT_TRUE(trials.ok()) << trials.status();
  ASSERT_EQ(trials->closed.size(), 1U);
  EXPECT_EQ(trials->closed.front().assembly, 1U);
  EXPECT_FALSE(WorkingMesh(trials->closed.front().complex).HasOpenFaces());
  EXPECT_EQ(trials->waiting, (std::vector<size_t>{2, 0}));
}

TEST(CloseTrials, GivesTheSameBitsAtAnyThreadCount) {
  const std::vector<ClosedTrial> one = CloseThree(3, 1), four = CloseThree(3, 4);
  ASSERT_EQ(one.size(), four.size());
  for (size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].assembly, four[i].assembly);
    EXPECT_EQ(one[i].complex.cells, four[i].complex.cells);
    EXPECT_EQ(one[i].complex.vertices, four[i].complex.vertices);
  }
}

}  // namespace
}  // namespace amhex
