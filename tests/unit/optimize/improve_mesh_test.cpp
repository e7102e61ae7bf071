// What ImproveMesh says about a mesh's boundary is so.
#include "optimize/improve_mesh.h"

#include <gtest/gtest.h>

#include <utility>

#include "output/validate.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"
#include "support/poor_meshes.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;
using testing_support::MeshOf;

constexpr GridSize kImprovedGrid{5, 4, 4};

ImprovedMesh Improved(CellComplex complex) {
  Hull hull = GridHull(kImprovedGrid, 0.5);
  hull.volume = kImprovedGrid.nx * kImprovedGrid.ny * kImprovedGrid.nz;
  const HullFeatures features(hull);
  const MeshingParams params;
  RunContext run;
  auto improved = ImproveMesh(std::move(complex), {hull, features, params}, run);
  EXPECT_TRUE(improved.ok()) << improved.status();
  return improved.ok() ? *std::move(improved) : ImprovedMesh{};
}

TEST(ImproveMesh, FindsNothingWrongWithAGrid) {
  EXPECT_FALSE(Improved(GridComplex(kImprovedGrid)).is_defective);
}

TEST(ImproveMesh, IsValidUnlessItSaysThatItMayNotBe) {
  const Hull hull = GridHull(kImprovedGrid, 0.5);
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const ImprovedMesh improved =
        Improved(testing_support::ClosedWithGaps(kImprovedGrid, hull, seed));
    const ValidationReport report = ValidateMesh(MeshOf(improved.complex));
    EXPECT_TRUE(report.valid() || improved.is_defective) << seed << ": " << report.Summary();
  }
  CellComplex overlapping = GridComplex(kImprovedGrid);
  testing_support::AddBeside(GridComplex(kImprovedGrid), {0.5, 0.5, 0.5}, overlapping);
  ASSERT_FALSE(ValidateMesh(MeshOf(overlapping)).valid());
  const ImprovedMesh improved = Improved(std::move(overlapping));
  EXPECT_TRUE(ValidateMesh(MeshOf(improved.complex)).valid() || improved.is_defective);
}

}  // namespace
}  // namespace amhex
