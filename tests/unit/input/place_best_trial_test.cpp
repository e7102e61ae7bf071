#include "place_best_trial.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "closure/working_mesh.h"
#include "output/validate.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridSize;
using testing_support::MeshOf;

constexpr GridSize kSize{4, 4, 4};

// The same cells again in the same place, which overlap: no step of placing can part them.
CellComplex TwiceOver(CellComplex complex) {
  const CellComplex once = complex;
  const auto offset = static_cast<int32_t>(once.vertices.size());
  complex.vertices.insert(complex.vertices.end(), once.vertices.begin(), once.vertices.end());
  for (CellCorners corners : once.cells) {
    for (int32_t& v : corners) v += offset;
    complex.cells.push_back(corners);
  }
  for (CellFace face : once.hull_faces) {
    for (int j = 0; j < face.count; ++j) face.v[j] += offset;
    complex.hull_faces.push_back(face);
  }
  return complex;
}

// The grid without one of its inner cells.
CellComplex GridWithHole() {
  WorkingMesh mesh(GridComplex(kSize));
  mesh.RemoveCell(21);
  return mesh.ToComplex();
}

CellComplex BestOf(const std::vector<CellComplex>& assemblies, ClosedTrials trials,
                   const SpareTrial& spare = {}) {
  Hull hull = testing_support::GridHull(kSize, 1);
  hull.volume = kSize.nx * kSize.ny * kSize.nz;
  MeshingParams params;
  params.run.backend = Backend::kCpu;
  RunContext run;
  absl::StatusOr<PlacedTrial> best =
      PlaceBestTrial(assemblies, std::move(trials), hull, params, run, spare);
  EXPECT_TRUE(best.ok()) << best.status();
  return best.ok() ? std::move(best->complex) : CellComplex();
}

TEST(PlaceBestTrial, TakesAValidTrialBeforeOneThatOverlapsItself) {
  const CellComplex grid = GridComplex(kSize), overlapping = TwiceOver(grid);
  ASSERT_FALSE(ValidateMesh(MeshOf(overlapping)).valid());
  for (const bool overlapping_first : {true, false}) {
    ClosedTrials trials;
    trials.closed = {{0, overlapping_first ? overlapping : grid},
                     {1, overlapping_first ? grid : overlapping}};
    const CellComplex best = BestOf({overlapping, overlapping}, std::move(trials));
    EXPECT_TRUE(ValidateMesh(MeshOf(best)).valid());
    EXPECT_EQ(best.cells.size(), grid.cells.size());
  }
}

TEST(PlaceBestTrial, ClosesATrialThatWaitsWhereNoOtherIsValid) {
  ClosedTrials trials;
  trials.closed = {{0, TwiceOver(GridComplex(kSize))}};
  trials.waiting = {1};
  const CellComplex best = BestOf({TwiceOver(GridComplex(kSize)), GridWithHole()}, trials);
  EXPECT_TRUE(ValidateMesh(MeshOf(best)).valid());
}

TEST(PlaceBestTrial, AssemblesTheSpareOneOnlyWhereTheOnlyOneIsPoor) {
  const CellComplex grid = GridComplex(kSize);
  for (const bool is_poor : {false, true}) {
    int assembled = 0;
    const SpareTrial spare = [&] {
      ++assembled;
      return AssembledTrials{{GridWithHole()}, {}};
    };
    ClosedTrials trials;
    trials.closed = {{0, is_poor ? TwiceOver(grid) : grid}};
    const CellComplex best = BestOf({TwiceOver(grid)}, std::move(trials), spare);
    EXPECT_EQ(assembled, is_poor ? 1 : 0);
    EXPECT_TRUE(ValidateMesh(MeshOf(best)).valid());
  }
}

TEST(PlaceBestTrial, DoesWithoutASpareOneThatFails) {
  const SpareTrial spare = [] { return absl::ResourceExhaustedError("too large"); };
  ClosedTrials trials;
  trials.closed = {{0, TwiceOver(GridComplex(kSize))}};
  const CellComplex best = BestOf({GridWithHole()}, std::move(trials), spare);
  EXPECT_TRUE(ValidateMesh(MeshOf(best)).valid());
}

TEST(PlaceBestTrial, FillsTheOnlyTrialAnewWhereItsFirstFillingIsInvalid) {
  ClosedTrials trials;
  trials.closed = {{0, TwiceOver(GridComplex(kSize))}};
  const CellComplex best = BestOf({GridWithHole()}, std::move(trials));
  EXPECT_TRUE(ValidateMesh(MeshOf(best)).valid());
  EXPECT_FALSE(WorkingMesh(best).HasOpenFaces());
}

}  // namespace
}  // namespace amhex
