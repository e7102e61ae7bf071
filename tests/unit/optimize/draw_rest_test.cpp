// Laws of the last word on distances: what is too far from the hull comes near enough, cells stay
// good, and where nothing is or gaps are everywhere nothing changes.
#include "optimize/draw_rest.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "optimize/face_places.h"
#include "optimize/hull_deviation.h"
#include "optimize/placement.h"
#include "optimize/raise_quality.h"
#include "output/validate.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"
#include "support/largest_distance.h"
#include "support/roof.h"

namespace amhex {
namespace {

using testing_support::CubesUnder;
using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;
using testing_support::GridVertex;
using testing_support::HullUnder;
using testing_support::LargestDistance;
using testing_support::Roof;

constexpr GridSize kSize = Roof().size;

CellComplex Drawn(const CellComplex& complex, const Hull& hull) {
  const RunContext run;
  auto drawn = DrawRest(complex, hull, HullFeatures(hull), run);
  EXPECT_TRUE(drawn.ok()) << drawn.status().ToString();
  return drawn->complex;
}

TEST(FacePlaces, AreSpreadOverTheFaceEachOnce) {
  for (const int count : {3, 4}) {
    const std::array<Vec3d, 4> corner = {
        Vec3d{0, 0, 0}, {1, 0, 0}, count == 3 ? Vec3d{0, 1, 0} : Vec3d{1, 1, 0}, {0, 1, 0}};
    std::vector<Vec3d> places;
    VisitFacePlaces(count, FaceDivisions(1), [&](const std::array<double, 4>& weight, int side) {
      Vec3d place;
      double sum = 0;
      for (int j = 0; j < count; ++j) place += corner[j] * weight[j], sum += weight[j];
      EXPECT_NEAR(sum, 1, 1e-12);
      for (int j = 0; j < count; ++j) {
        const bool is_on = std::abs(weight[j] + weight[(j + 1) % count] - 1) < 1e-12;
        EXPECT_EQ(is_on, side == j) << count << " corners, side " << j;
        EXPECT_GT(Norm(place - corner[j]), 0.1) << "a corner";
      }
      for (const Vec3d& other : places) EXPECT_GT(Norm(place - other), 0.1) << "twice";
      places.push_back(place);
    });
    // Nothing of the face is far from all of them.
    for (double x = 0; x <= 1; x += 0.05) {
      for (double y = 0; y <= (count == 3 ? 1 - x : 1.0); y += 0.05) {
        const Vec3d p{x, y, 0};
        const bool is_near = std::any_of(places.begin(), places.end(),
                                         [&](const Vec3d& q) { return Norm(p - q) < 0.18; });
        EXPECT_TRUE(is_near) << count << " corners: " << x << " " << y;
      }
    }
  }
}

TEST(HullSampling, FindsNoLessWhereFacesAreLookedAtClosely) {
  const Roof roof{2.5, -0.6};  // a valley: faces are far from the hull, too
  const Hull hull = HullUnder(roof);
  CellComplex complex = CubesUnder(roof);
  const HullFeatures features(hull);
  const Placement placement = PreparePlacement(complex, features);
  const HullSampling sampling(hull, placement);
  const double limit = LimitsFor(hull).limit;
  const std::vector<Gap> few = sampling.GapsBeyond(limit, StopPoll());
  const std::vector<Gap> close = sampling.GapsBeyond(limit, StopPoll(), FaceDetail::kClosely);
  ASSERT_FALSE(few.empty());
  EXPECT_GT(close.size(), few.size());
  EXPECT_GE(close.front().distance, few.front().distance);
}

TEST(HullSampling, FindsVerticesThatHaveLeftTheHull) {
  const Hull hull = GridHull(kSize, 0.5);
  CellComplex complex = GridComplex(kSize);
  const int32_t top = GridVertex(kSize, 3, 2, kSize.nz);
  complex.vertices[top].z += 0.3;
  const HullFeatures features(hull);
  const Placement placement = PreparePlacement(complex, features);
  const std::vector<Gap> gaps =
      HullSampling(hull, placement).GapsBeyond(0.2, StopPoll(), FaceDetail::kClosely);
  ASSERT_FALSE(gaps.empty());
  EXPECT_EQ(gaps.front().sample, complex.vertices[top]);
  EXPECT_NEAR(gaps.front().distance, 0.3, 1e-9);
}

// A box with one point in so many a third of an edge length above its top.
Hull BoxWithPointsAbove(int one_in) {
  Hull hull = GridHull(kSize, 0.5);
  for (int i = 0; i < 400; ++i) {
    const double x = 0.5 + (i % 20) * 0.25, y = 0.5 + static_cast<double>(i / 20) * 0.15;
    hull.input_points.push_back({x, y, kSize.nz + (i % one_in == 0 ? 1 / 3.0 : 0.0)});
  }
  return hull;
}

size_t CountAbove(const std::vector<Vec3d>& points) {
  return static_cast<size_t>(std::count_if(points.begin(), points.end(),
                                           [](const Vec3d& p) { return p.z > kSize.nz + 0.1; }));
}

TEST(HullSampling, FollowsTheHullWherePointsScatterAndTheFewThatStandOut) {
  for (const int one_in : {4, 39}) {
    const Hull hull = BoxWithPointsAbove(one_in);
    CellComplex complex = GridComplex(kSize);
    const HullFeatures features(hull);
    const Placement placement = PreparePlacement(complex, features);
    const HullSampling sampling(hull, placement);
    EXPECT_EQ(sampling.points_scatter(), one_in == 4);
    EXPECT_EQ(CountAbove(sampling.points()), one_in == 4 ? 0 : CountAbove(hull.input_points));
  }
}

TEST(DrawRest, OfNothingIsNothing) {
  EXPECT_TRUE(Drawn(CellComplex{}, HullUnder({2.5, 0.45})).cells.empty());
}

TEST(DrawRest, LeavesABoundaryOnTheHullAsItIs) {
  const CellComplex complex = GridComplex(kSize);
  const CellComplex drawn = Drawn(complex, GridHull(kSize, 0.5));
  EXPECT_EQ(drawn.vertices, complex.vertices);
  EXPECT_EQ(drawn.cells, complex.cells);
}

TEST(DrawRest, BringsWhatIsTooFarNearEnough) {
  for (const double height : {0.45, -0.45}) {
    for (const double ridge_x : {2.4, 2.5, 3.5}) {
      const Roof roof{ridge_x, height};
      const Hull hull = HullUnder(roof);
      const CellComplex complex = CubesUnder(roof);
      const double limit = LimitsFor(hull).limit;
      ASSERT_GT(LargestDistance(complex, hull), limit);
      const CellComplex drawn = Drawn(complex, hull);
      EXPECT_LE(LargestDistance(drawn, hull), limit) << ridge_x << " " << height;
      EXPECT_GE(SummarizeQuality(drawn).minimum, 0.31) << ridge_x << " " << height;
      EXPECT_EQ(drawn.cells, complex.cells);
      const ValidationReport report = ValidateMesh(testing_support::MeshOf(drawn));
      EXPECT_TRUE(report.valid()) << report.Summary();
    }
  }
}

TEST(DrawRest, LowersTheMinimumOnlyWhereAllIsNearAfterwards) {
  int kept = 0;
  for (const double height : {-0.9, -0.45, 0.45, 0.7, 0.9, 1.2}) {
    const Roof roof{2.5, height};
    const Hull hull = HullUnder(roof);
    const CellComplex complex = CubesUnder(roof);
    const double before = SummarizeQuality(complex).minimum;
    const CellComplex drawn = Drawn(complex, hull);
    const double after = SummarizeQuality(drawn).minimum;
    EXPECT_GE(after, std::min(before, 0.31)) << height;
    // Statistics look at other places, too.
    const bool is_near = LargestDistance(drawn, hull) <= 1.05 * LimitsFor(hull).limit;
    EXPECT_TRUE(is_near || after >= std::min(before, 0.5)) << height << " " << after;
    kept += is_near ? 0 : 1;
  }
  EXPECT_GT(kept, 0) << "or the test shows nothing";
}

// Every gap along the ridge is a place.
constexpr Roof kLongRoof{2.5, 1.1, {6, 72, 3}};
constexpr size_t kMany = 64;

size_t CountPlaces(CellComplex complex, const Hull& hull) {
  const HullFeatures features(hull);
  const Placement placement = PreparePlacement(complex, features);
  const double limit = LimitsFor(hull).limit;
  const auto gaps = HullSampling(hull, placement).GapsBeyond(limit, {}, FaceDetail::kClosely);
  return DistinctGaps(gaps, {}).size();
}

TEST(DrawRest, DrawsTheFarthestWhereAHullIsFarInManyPlaces) {
  const Hull hull = HullUnder(kLongRoof);
  const CellComplex complex = CubesUnder(kLongRoof);
  ASSERT_GT(CountPlaces(complex, hull), kMany);
  const CellComplex drawn = Drawn(complex, hull);
  EXPECT_LT(CountPlaces(drawn, hull), kMany / 4);
  EXPECT_GE(SummarizeQuality(drawn).minimum, 0.31);
}

TEST(DrawRest, LeavesScatteredPointsThatAreFarInManyPlacesAsTheyAre) {
  Hull hull = HullUnder(kLongRoof);
  for (int i = 0; i < 400; ++i) {
    const double z = kLongRoof.size.nz + (i % 4 == 0 ? 1.0 : 0.0);
    hull.input_points.push_back({0.5, 1 + i * 0.17, z});
  }
  CellComplex complex = CubesUnder(kLongRoof);
  const HullFeatures features(hull);
  const Placement placement = PreparePlacement(complex, features);
  ASSERT_TRUE(HullSampling(hull, placement).points_scatter());
  EXPECT_EQ(Drawn(complex, hull).vertices, complex.vertices);
}

TEST(DrawRest, IsTheSameAtAnyThreadCount) {
  const Roof roof{2.5, 0.45};
  const Hull hull = HullUnder(roof);
  const CellComplex complex = CubesUnder(roof);
  std::vector<CellComplex> results;
  for (const size_t threads : {1, 2, 7}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(Drawn(complex, hull));
  }
  EXPECT_NE(results[0].vertices, complex.vertices);
  for (const CellComplex& other : results) EXPECT_EQ(results[0].vertices, other.vertices);
}

TEST(DrawRest, TellsWhetherAllIsNear) {
  const Roof roof{2.5, 0.5};
  const Hull hull = HullUnder(roof);
  const CellComplex complex = CubesUnder(roof);
  const HullFeatures features(hull);
  const RunContext run;
  const auto refused = DrawRest(complex, hull, features, run, 0);
  ASSERT_TRUE(refused.ok());
  EXPECT_FALSE(refused->is_near()) << "of more places than asked for nothing is drawn";
  EXPECT_TRUE(refused->complex.vertices == complex.vertices);
  const auto drawn = DrawRest(complex, hull, features, run);
  ASSERT_TRUE(drawn.ok());
  EXPECT_TRUE(drawn->is_near());
  const auto again = DrawRest(drawn->complex, hull, features, run, 0);
  ASSERT_TRUE(again.ok());
  EXPECT_TRUE(again->is_near()) << "there is none";
  EXPECT_TRUE(again->complex.vertices == drawn->complex.vertices);
}

TEST(DrawRest, StopsWhenAsked) {
  const Roof roof{2.5, 0.5};
  const Hull hull = HullUnder(roof);
  RunContext run;
  run.RequestStop();
  const auto drawn = DrawRest(CubesUnder(roof), hull, HullFeatures(hull), run);
  EXPECT_EQ(drawn.status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace amhex
