#include "assembly/assemble.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "topology/extract_topology.h"
#include "topology/half_face.h"
#include "unit/topology/cube_grid.h"

namespace amhex {
namespace {

using ::amhex::testing::MakeCubeGrid;

CellComplex Assembled(const MergedCubes& cubes, const MeshingParams& params = {}) {
  RunContext context;
  const auto table = ExtractTopology(cubes, params, context);
  EXPECT_TRUE(table.ok()) << table.status().ToString();
  auto complex = AssembleCells(*table, cubes, params, context);
  EXPECT_TRUE(complex.ok()) << complex.status().ToString();
  return *complex;
}

std::multiset<CellFace> HalfFacesOf(const CellComplex& complex) {
  std::multiset<CellFace> half_faces;
  for (const CellCorners& cell : complex.cells) {
    for (const CellFace& face : FacesOf(cell)) half_faces.insert(CanonicalHalfFace(face));
  }
  return half_faces;
}

// Half-faces of cells that neither another cell nor the hull closes.
std::vector<CellFace> OpenFacesOf(const CellComplex& complex) {
  const std::multiset<CellFace> half_faces = HalfFacesOf(complex);
  std::set<CellFace> hull;
  for (const CellFace& face : complex.hull_faces) hull.insert(CanonicalHalfFace(face));
  std::vector<CellFace> open;
  for (const CellFace& face : half_faces) {
    if (half_faces.count(OppositeHalfFace(face)) == 0 && hull.count(face) == 0) {
      open.push_back(face);
    }
  }
  return open;
}

TEST(Assembly, NoCubesGiveNoCells) { EXPECT_TRUE(Assembled(MergedCubes{}).cells.empty()); }

TEST(Assembly, TwoByTwoByTwoCubesGiveEightHexahedraAndNoOpenFace) {
  const CellComplex complex = Assembled(MakeCubeGrid(2, 2, 2));
  EXPECT_EQ(complex.cells.size(), 8u);
  EXPECT_EQ(complex.hull_faces.size(), 24u);
  EXPECT_TRUE(OpenFacesOf(complex).empty());
}

TEST(Assembly, OfTwoEqualCubesOnlyOneBecomesACell) {
  MergedCubes cubes = MakeCubeGrid(1, 1, 1);
  cubes.corners.push_back(cubes.corners[0]);
  cubes.hull_faces.push_back(cubes.hull_faces[0]);
  cubes.matches.push_back(cubes.matches[0]);
  EXPECT_EQ(Assembled(cubes).cells.size(), 1u);
}

TEST(Assembly, ACancelledRunEndsWithCancelled) {
  RunContext context;
  context.RequestStop();
  const MergedCubes cubes = MakeCubeGrid(2, 2, 2);
  EXPECT_EQ(ExtractTopology(cubes, MeshingParams{}, context).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace amhex
