// Laws of refilling: nothing gets poorer, nothing far away moves, the mesh stays closed.
#include "optimize/refill_places.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "closure/boundary_defects.h"
#include "closure/working_mesh.h"
#include "optimize/raise_quality.h"
#include "output/validate.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"
#include "support/poor_meshes.h"

namespace amhex {
namespace {

using testing_support::ClosedWithGaps;
using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;
using testing_support::WithPoorStars;

CellComplex Refilled(const CellComplex& complex, const Hull& hull) {
  const RunContext run;
  auto refilled = RefillPlaces(complex, hull, HullFeatures(hull), MeshingParams{}, run);
  EXPECT_TRUE(refilled.ok()) << refilled.status().ToString();
  return *refilled;
}

TEST(RefillPlaces, LeavesAMeshWithoutPoorCellsAsItIs) {
  testing_support::ExpectLeavesGoodCellsAsTheyAre(Refilled);
}

TEST(RefillPlaces, MendsAPoorPlaceAndMovesNothingFarFromIt) {
  testing_support::ExpectMendsAPlaceAndMovesNothingFarFromIt(Refilled);
}

// As where the end of a part has no cells.
TEST(RefillPlaces, MendsAPoorPlaceOfAMeshThatEndsFarFromTheHullElsewhere) {
  const GridSize n{14, 5, 5};
  const CellComplex complex = WithPoorStars(n, {{2.5, 2.5, 2.5}});
  const Hull hull = GridHull({16, 5, 5}, 0.5);
  ASSERT_FALSE(FindBoundaryDefects(WorkingMesh(complex), hull).vertices.empty());
  ASSERT_LT(SummarizeQuality(complex).minimum, 0.1);
  EXPECT_GT(SummarizeQuality(Refilled(complex, hull)).minimum, 0.3);
}

TEST(RefillPlaces, MendsEveryPlaceOnItsOwn) {
  const GridSize n{24, 6, 6};
  const CellComplex complex =
      WithPoorStars(n, {{2.5, 2.5, 2.5}, {6.5, 3.5, 2.5}, {12.5, 0.5, 0.5}, {21.5, 2.5, 5.5}});
  const Hull hull = GridHull(n, 0.5);
  std::vector<CellComplex> results;
  for (const size_t threads : {1, 2, 7}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(Refilled(complex, hull));
  }
  EXPECT_GT(SummarizeQuality(results[0]).minimum, 0.3);
  for (const CellComplex& other : results) {
    EXPECT_EQ(results[0].cells, other.cells);
    EXPECT_EQ(results[0].vertices, other.vertices);
    EXPECT_EQ(results[0].hull_faces.size(), other.hull_faces.size());
  }
}

// Stars that share faces make one place, and it is too large to be opened as a whole.
TEST(RefillPlaces, MendsPoorCellsOfManyStarsTogether) {
  const GridSize n{8, 8, 5};
  std::vector<Vec3d> places;
  for (int x = 1; x < 7; ++x) {
    for (int y = 1; y < 7; ++y) places.push_back({x + 0.5, y + 0.5, 2.5});
  }
  const CellComplex complex = WithPoorStars(n, places);
  ASSERT_LT(SummarizeQuality(complex).minimum, 0.1);
  const CellComplex refilled = Refilled(complex, GridHull(n, 0.5));
  EXPECT_GT(SummarizeQuality(refilled).average, SummarizeQuality(complex).average + 0.02);
  EXPECT_GT(SummarizeQuality(refilled).minimum, 0.25);
  const ValidationReport report = ValidateMesh(testing_support::MeshOf(refilled));
  EXPECT_TRUE(report.valid()) << report.Summary();
}

TEST(RefillPlaces, NeverLowersTheMinimumNorOpensAMesh) {
  const GridSize n{5, 4, 4};
  const Hull hull = GridHull(n, 0.5);
  int poor = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const CellComplex closed = ClosedWithGaps(n, hull, seed);
    const double before = SummarizeQuality(closed).minimum;
    poor += before < 0.3 ? 1 : 0;
    const CellComplex refilled = Refilled(closed, hull);
    EXPECT_GE(SummarizeQuality(refilled).minimum, before) << "seed " << seed;
    EXPECT_FALSE(WorkingMesh(refilled).HasOpenFaces()) << "seed " << seed;
  }
  EXPECT_GT(poor, 1) << "or the test shows nothing";
}

// Several threads make all tries of a single place side by side, one thread up to the first good
// one.
TEST(RefillPlaces, ComesToTheSameWhenTriesAreMadeAhead) {
  const GridSize n{5, 4, 4};
  const Hull hull = GridHull(n, 0.5);
  int changed = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const CellComplex closed = ClosedWithGaps(n, hull, seed);
    std::vector<CellComplex> results;
    for (const size_t threads : {1, 7}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      results.push_back(Refilled(closed, hull));
    }
    changed += results[0].cells != closed.cells ? 1 : 0;
    EXPECT_EQ(results[0].cells, results[1].cells) << "seed " << seed;
    EXPECT_EQ(results[0].vertices, results[1].vertices) << "seed " << seed;
  }
  EXPECT_GT(changed, 1) << "or the test shows nothing";
}

TEST(RefillPlaces, StopsWhenAsked) {
  const GridSize n{6, 6, 6};
  const Hull hull = GridHull(n, 0.5);
  RunContext run;
  run.RequestStop();
  const auto refilled = RefillPlaces(WithPoorStars(n, {{2.5, 2.5, 2.5}}), hull, HullFeatures(hull),
                                     MeshingParams{}, run);
  EXPECT_EQ(refilled.status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace amhex
