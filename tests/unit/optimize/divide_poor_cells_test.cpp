// Laws of dividing poor cells: nothing gets poorer, nothing far away moves, the mesh stays closed.
#include "optimize/divide_poor_cells.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <vector>

#include "closure/boundary_defects.h"
#include "closure/working_mesh.h"
#include "input/hull_queries.h"
#include "optimize/raise_quality.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"
#include "support/poor_meshes.h"

namespace amhex {
namespace {

using testing_support::ClosedWithGaps;
using testing_support::GridHull;
using testing_support::GridSize;
using testing_support::WithPoorStars;

CellComplex WithPoorDivided(const CellComplex& complex, const Hull& hull) {
  const RunContext run;
  const HullFeatures features(hull);
  const MeshingParams params;
  auto divided = DividePoorCells(complex, {hull, features, params, run});
  EXPECT_TRUE(divided.ok()) << divided.status().ToString();
  return *std::move(divided);
}

TEST(DividePoorCells, LeavesAMeshWithoutPoorCellsAsItIs) {
  testing_support::ExpectLeavesGoodCellsAsTheyAre(WithPoorDivided);
}

TEST(DividePoorCells, MendsAPoorPlaceAndMovesNothingFarFromIt) {
  testing_support::ExpectMendsAPlaceAndMovesNothingFarFromIt(WithPoorDivided);
}

TEST(DividePoorCells, NeverLowersTheMinimumNorOpensAMesh) {
  const GridSize n{5, 4, 4};
  const Hull hull = GridHull(n, 0.5);
  int changed = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const CellComplex closed = ClosedWithGaps(n, hull, seed);
    std::vector<CellComplex> results;
    for (const size_t threads : {1, 7}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      results.push_back(WithPoorDivided(closed, hull));
    }
    EXPECT_EQ(results[0].cells, results[1].cells) << "seed " << seed;
    EXPECT_EQ(results[0].vertices, results[1].vertices) << "seed " << seed;
    changed += results[0].cells != closed.cells ? 1 : 0;
    EXPECT_GE(SummarizeQuality(results[0]).minimum, SummarizeQuality(closed).minimum)
        << "seed " << seed;
    const WorkingMesh mesh(results[0]);
    EXPECT_FALSE(mesh.HasOpenFaces()) << "seed " << seed;
    EXPECT_TRUE(NewBoundaryDefects(WorkingMesh(closed), mesh, hull).empty()) << "seed " << seed;
  }
  EXPECT_GT(changed, 1) << "or the test shows nothing";
}

TEST(DividePoorCells, KeepsTheBoundaryOnTheHull) {
  const GridSize n{5, 4, 4};
  const Hull hull = GridHull(n, 0.5);
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const CellComplex divided = WithPoorDivided(ClosedWithGaps(n, hull, seed), hull);
    for (const CellFace& face : divided.hull_faces) {
      for (int j = 0; j < face.count; ++j) {
        EXPECT_LT(hull.queries->Closest(divided.vertices[face.v[j]]).distance, 0.3);
      }
    }
  }
}

TEST(DividePoorCells, StopsWhenAsked) {
  const GridSize n{6, 6, 6};
  const Hull hull = GridHull(n, 0.5);
  const HullFeatures features(hull);
  const MeshingParams params;
  RunContext run;
  run.RequestStop();
  const auto divided =
      DividePoorCells(WithPoorStars(n, {{2.5, 2.5, 2.5}}), {hull, features, params, run});
  EXPECT_EQ(divided.status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace amhex
