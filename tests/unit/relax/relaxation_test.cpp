#include "relax/relaxation.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <vector>

#include "fixtures/solids.h"
#include "input/hull_queries.h"
#include "input/site_grid.h"
#include "unit/relax/relax_fixtures.h"

namespace amhex {
namespace {

MeshingParams GridParams(int32_t iteration_count) {
  MeshingParams params;
  params.run.backend = Backend::kCpu;
  params.relaxation.initialization = Initialization::kJitteredGrid;
  params.relaxation.iteration_count = iteration_count;
  params.relaxation.lattice_points_per_site = 60;
  return params;
}

struct Relaxed {
  Hull hull;
  Sites start;
  absl::StatusOr<Sites> result = absl::UnknownError("not run");
};

Relaxed Relax(const TriangleMesh& solid, const MeshingParams& params, RunContext& run) {
  Relaxed relaxed;
  relaxed.hull = testing_support::HullOfMesh(solid);
  const HullSamples samples = SamplesOf(relaxed.hull);
  absl::StatusOr<Sites> start = PopulateGrid(relaxed.hull, samples, params, run);
  if (!start.ok()) {
    relaxed.result = start.status();
    return relaxed;
  }
  relaxed.start = *start;
  relaxed.result = RelaxSites(relaxed.hull, samples, *std::move(start), params, run);
  return relaxed;
}

int64_t CountInside(const Hull& hull, const Sites& sites) {
  int64_t count = 0;
  for (const Vec3d& p : sites.position) count += hull.queries->IsInside(p) ? 1 : 0;
  return count;
}

// Mean over sites of the distance to the nearest other site, and its smallest value.
double SmallestGap(const Sites& sites) {
  double smallest = 1e300;
  for (size_t i = 0; i < sites.position.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      smallest = std::fmin(smallest, Norm(sites.position[i] - sites.position[j]));
    }
  }
  return smallest;
}

TEST(Relaxation, NeverLosesASiteNorLetsOneCrossTheHull) {
  RunContext run;
  for (const TriangleMesh& solid :
       {fixtures::MakeTorus(4, 1.5, 0.5), fixtures::MakeTwistedBox({5, 5, 8}, 1.0, 0.6)}) {
    const Relaxed r = Relax(solid, GridParams(24), run);
    ASSERT_TRUE(r.result.ok()) << r.result.status();
    EXPECT_GE(r.result->count(), CountInside(r.hull, r.start));
    for (const Vec3d& p : r.result->position) {
      // In or out is known to the nearest lattice point.
      EXPECT_LT(r.hull.queries->SignedDistance(p), 0.2);
    }
  }
}

TEST(Relaxation, CellsFillTheHull) {
  RunContext run;
  const Relaxed r = Relax(fixtures::MakeSphere(3.5, 0.4), GridParams(15), run);
  ASSERT_TRUE(r.result.ok());
  double volume = 0;
  for (const double v : r.result->cell_volume) {
    EXPECT_GT(v, 0);
    volume += v;
  }
  EXPECT_NEAR(volume / r.hull.volume, 1, 0.01);
}

TEST(Relaxation, FramesStayOrthonormalAndRightHanded) {
  RunContext run;
  const Relaxed r = Relax(fixtures::MakeTorus(4, 1.5, 0.5), GridParams(10), run);
  ASSERT_TRUE(r.result.ok());
  for (const AxisFrame& frame : r.result->frame) {
    EXPECT_NEAR(Determinant(frame.axis[0], frame.axis[1], frame.axis[2]), 1, 1e-9);
    EXPECT_NEAR(Dot(frame.axis[0], frame.axis[1]), 0, 1e-9);
  }
}

TEST(Relaxation, GivesTheSameBitsAtAnyThreadCount) {
  const auto relax_with = [](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    RunContext run;
    return *Relax(fixtures::MakeTorus(4, 1.5, 0.5), GridParams(12), run).result;
  };
  const Sites one = relax_with(1), four = relax_with(4);
  ASSERT_EQ(one.count(), four.count());
  EXPECT_EQ(one.position, four.position);
  EXPECT_EQ(one.cell_volume, four.cell_volume);
  for (size_t i = 0; i < one.frame.size(); ++i) EXPECT_EQ(one.frame[i].axis, four.frame[i].axis);
}

TEST(Relaxation, AGridThatFitsABoxStaysWhereItIs) {
  RunContext run;
  MeshingParams params = GridParams(20);
  params.relaxation.initialization = Initialization::kGrid;
  params.relaxation.lattice_points_per_site = 108;
  const Relaxed r = Relax(fixtures::MakeBox({4, 5, 6}, 0.5), params, run);
  ASSERT_TRUE(r.result.ok()) << r.result.status();
  ASSERT_EQ(r.result->count(), 120);
  for (size_t i = 0; i < 120; ++i) {
    const Vec3d p = r.result->position[i];
    const Vec3d nearest = {std::floor(p.x) + 0.5, std::floor(p.y) + 0.5, std::floor(p.z) + 0.5};
    EXPECT_NEAR(Norm(p - nearest), 0, 0.02);
    EXPECT_NEAR(r.result->cell_volume[i], 1, 0.1);
  }
}

TEST(Relaxation, SpreadsJitteredSitesAndComesToRest) {
  RunContext run;
  std::vector<double> movement;
  run.on_progress = [&](const Progress& p) {
    if (p.iteration > 0) movement.push_back(p.mean_movement);
  };
  MeshingParams params = GridParams(40);
  params.relaxation.jitter = 0.4;
  const Relaxed r = Relax(fixtures::MakeSphere(4, 0.5), params, run);
  ASSERT_TRUE(r.result.ok());
  ASSERT_EQ(movement.size(), 40u);
  EXPECT_LT(movement.back(), 0.25 * movement.front());
  EXPECT_GT(SmallestGap(*r.result), SmallestGap(r.start) + 0.1);
}

TEST(Relaxation, SitesUnderAFlatHullTurnAnAxisToItsNormal) {
  RunContext run;
  const Relaxed r = Relax(fixtures::MakeTwistedBox({6, 6, 6}, 0.6, 0.5), GridParams(20), run);
  ASSERT_TRUE(r.result.ok());
  double sum = 0;
  int count = 0;
  for (size_t i = 0; i < r.result->position.size(); ++i) {
    const HullPoint nearest = r.hull.queries->Closest(r.result->position[i]);
    if (nearest.distance > 0.6) continue;
    double best = 0;
    for (const Vec3d& axis : r.result->frame[i].axis) {
      best = std::fmax(best, std::abs(Dot(axis, nearest.normal)));
    }
    sum += best;
    ++count;
  }
  ASSERT_GT(count, 50);
  EXPECT_GT(sum / count, 0.98);
}

TEST(Relaxation, WithoutIterationsOnlyMeasures) {
  RunContext run;
  MeshingParams params = GridParams(-1);
  params.relaxation.initialization = Initialization::kField;
  const Hull hull = testing_support::HullOfMesh(fixtures::MakeBox({3, 3, 3}, 1));
  Sites sites;
  for (int i = 0; i < 28; ++i) {
    // The last one lies outside.
    sites.position.push_back(i < 27 ? Vec3d{i % 3 + 0.5, i / 3 % 3 + 0.5, i / 9 + 0.5}
                                    : Vec3d{7, 1, 1});
    sites.frame.emplace_back();
    sites.size.push_back({1, 1, 1});
    sites.cell_volume.push_back(0);
  }
  sites.links = {{0, 1, 1, 0, 3}, {26, 27, 1, 0, 1}};
  const auto result = RelaxSites(hull, SamplesOf(hull), sites, params, run);
  ASSERT_TRUE(result.ok()) << result.status();
  ASSERT_EQ(result->count(), 27);
  for (size_t i = 0; i < 27; ++i) {
    EXPECT_EQ(result->position[i], sites.position[i]);
    EXPECT_NEAR(result->cell_volume[i], 1, 0.1);
  }
  ASSERT_EQ(result->links.size(), 1u);
  EXPECT_EQ(result->links[0].site_b, 1);
}

TEST(Relaxation, CancelStopsWithinOneIteration) {
  RunContext run;
  int iterations = 0;
  run.on_progress = [&](const Progress& p) {
    if (p.iteration == 0) return;
    ++iterations;
    if (p.iteration == 3) run.RequestStop();
  };
  const Relaxed r = Relax(fixtures::MakeSphere(3.5, 0.5), GridParams(100), run);
  EXPECT_EQ(r.result.status().code(), absl::StatusCode::kCancelled);
  EXPECT_LE(iterations, 4);
}

TEST(Relaxation, SaysWhenNoSiteLiesInside) {
  RunContext run;
  const Hull hull = testing_support::HullOfMesh(fixtures::MakeBox({3, 3, 3}, 1));
  Sites sites;
  sites.position = {{9, 9, 9}};
  sites.frame.emplace_back();
  sites.size = {{1, 1, 1}};
  sites.cell_volume = {0};
  const auto result = RelaxSites(hull, SamplesOf(hull), sites, GridParams(5), run);
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(ResolveIterationCount, IsZeroAfterTheFieldAndThePapers150AfterGrids) {
  RelaxationParams params;
  EXPECT_EQ(ResolveIterationCount(params), 0);
  params.initialization = Initialization::kGrid;
  EXPECT_EQ(ResolveIterationCount(params), 150);
  params.iteration_count = 7;
  EXPECT_EQ(ResolveIterationCount(params), 7);
}

}  // namespace
}  // namespace amhex
