#include "assembly/assemble.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

#include "assembly/overlap.h"
#include "optimize/cell_quality.h"
#include "topology/extract_topology.h"
#include "topology/half_face.h"
#include "unit/topology/cube_grid.h"

namespace amhex {
namespace {

using ::amhex::testing::MakeCubeGrid;

MeshingParams ParamsFor(Extraction extraction) {
  MeshingParams params;
  params.assembly.extraction = extraction;
  return params;
}

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

std::set<CellFace> HullOf(const CellComplex& complex) {
  std::set<CellFace> hull;
  for (const CellFace& face : complex.hull_faces) hull.insert(CanonicalHalfFace(face));
  return hull;
}

// Half-faces of cells that neither another cell nor the hull closes.
std::vector<CellFace> OpenFacesOf(const CellComplex& complex) {
  const std::multiset<CellFace> half_faces = HalfFacesOf(complex);
  const std::set<CellFace> hull = HullOf(complex);
  std::vector<CellFace> open;
  for (const CellFace& face : half_faces) {
    if (half_faces.count(OppositeHalfFace(face)) == 0 && hull.count(face) == 0) {
      open.push_back(face);
    }
  }
  return open;
}

double VolumeOf(const CellComplex& complex) {
  double volume = 0;
  for (const CellCorners& cell : complex.cells) volume += CellVolume(cell, complex.vertices);
  return volume;
}

// Removes a cube from the grid, as if its merge had failed; its neighbours stay.
void RemoveCube(int cube, MergedCubes* cubes) {
  cubes->corners.erase(cubes->corners.begin() + cube);
  cubes->hull_faces.erase(cubes->hull_faces.begin() + cube);
  cubes->matches.erase(cubes->matches.begin() + cube);
}

// Moves some inner vertices far, others a little.
MergedCubes JitteredGrid(uint32_t seed) {
  MergedCubes grid = MakeCubeGrid(4, 4, 4);
  std::mt19937 random(seed);
  const auto uniform = [&] { return 2.0 * random() / std::mt19937::max() - 1.0; };
  for (size_t v = 0; v < grid.vertices.size(); ++v) {
    if (grid.on_hull[v] != 0) continue;
    const double reach = random() % 3 == 0 ? 0.9 : 0.15;
    grid.vertices[v] += Vec3d{uniform(), uniform(), uniform()} * reach;
  }
  return grid;
}

TEST(Assembly, NoCubesGiveNoCells) {
  EXPECT_TRUE(Assembled(MergedCubes{}).cells.empty());
  EXPECT_TRUE(Assembled(MergedCubes{}, ParamsFor(Extraction::kPaper)).cells.empty());
}

TEST(Assembly, TwoByTwoByTwoCubesGiveEightHexahedraAndNoOpenFace) {
  for (const Extraction extraction : {Extraction::kDirect, Extraction::kPaper}) {
    const CellComplex complex = Assembled(MakeCubeGrid(2, 2, 2), ParamsFor(extraction));
    EXPECT_EQ(complex.cells.size(), 8u);
    EXPECT_EQ(complex.hull_faces.size(), 24u);
    EXPECT_TRUE(OpenFacesOf(complex).empty());
  }
}

TEST(Assembly, BothExtractionsChooseTheSameCellsOfARegularGrid) {
  const MergedCubes grid = MakeCubeGrid(4, 3, 5);
  EXPECT_EQ(HalfFacesOf(Assembled(grid, ParamsFor(Extraction::kDirect))),
            HalfFacesOf(Assembled(grid, ParamsFor(Extraction::kPaper))));
}

TEST(Assembly, OfTwoEqualCubesOnlyOneBecomesACell) {
  MergedCubes cubes = MakeCubeGrid(1, 1, 1);
  cubes.corners.push_back(cubes.corners[0]);
  cubes.hull_faces.push_back(cubes.hull_faces[0]);
  cubes.matches.push_back(cubes.matches[0]);
  EXPECT_EQ(Assembled(cubes).cells.size(), 1u);
}

TEST(Assembly, AMissingCubeIsFoundByItsNeighboursFaces) {
  for (const Extraction extraction : {Extraction::kDirect, Extraction::kPaper}) {
    MergedCubes cubes = MakeCubeGrid(3, 3, 3);
    RemoveCube(13, &cubes);
    const CellComplex complex = Assembled(cubes, ParamsFor(extraction));
    EXPECT_EQ(complex.cells.size(), 27u);
    EXPECT_TRUE(OpenFacesOf(complex).empty());
  }
}

TEST(Assembly, TheOutsideOfTheHullIsNeverFilled) {
  // The hull runs around the missing middle cube.
  MergedCubes cubes = MakeCubeGrid(3, 3, 3);
  RemoveCube(13, &cubes);
  const std::set<size_t> around = {4, 10, 12, 13, 15, 21};  // after the removal
  const uint8_t towards[] = {1 << 5, 1 << 3, 1 << 1, 1 << 0, 1 << 2, 1 << 4};
  size_t i = 0;
  for (const size_t cube : around) cubes.hull_faces[cube] |= towards[i++];
  const CellComplex complex = Assembled(cubes);
  EXPECT_EQ(complex.cells.size(), 26u);
  EXPECT_TRUE(OpenFacesOf(complex).empty());
  EXPECT_EQ(complex.hull_faces.size(), 54u + 6u);
}

TEST(Assembly, AHullFaceWithACellAgainstItIsNotOnTheHull) {
  MergedCubes cubes = MakeCubeGrid(2, 1, 1);
  cubes.hull_faces[0] |= 1 << 1;  // towards the other cube
  const CellComplex complex = Assembled(cubes);
  EXPECT_EQ(complex.hull_faces.size(), 10u);
}

TEST(Assembly, NeverFallsBelowMinimumQuality) {
  for (uint32_t seed = 0; seed < 10; ++seed) {
    const Extraction extraction = seed % 2 == 0 ? Extraction::kDirect : Extraction::kPaper;
    MeshingParams params = ParamsFor(extraction);
    params.assembly.min_quality = 0.1 + 0.05 * (seed % 4);
    const CellComplex complex = Assembled(JitteredGrid(seed), params);
    EXPECT_FALSE(complex.cells.empty());
    for (const CellCorners& cell : complex.cells) {
      EXPECT_GT(CellQuality(cell, complex.vertices), params.assembly.min_quality);
    }
  }
}

TEST(Assembly, EveryHalfFaceIsUsedAtMostOnceAndHullFacesAreFreeHalfFacesOfCells) {
  for (uint32_t seed = 0; seed < 20; ++seed) {
    const Extraction extraction = seed % 2 == 0 ? Extraction::kDirect : Extraction::kPaper;
    const CellComplex complex = Assembled(JitteredGrid(seed), ParamsFor(extraction));
    const std::multiset<CellFace> half_faces = HalfFacesOf(complex);
    for (const CellFace& face : half_faces) EXPECT_EQ(half_faces.count(face), 1u);
    EXPECT_EQ(HullOf(complex).size(), complex.hull_faces.size());
    for (const CellFace& face : HullOf(complex)) {
      EXPECT_EQ(half_faces.count(face), 1u);
      EXPECT_EQ(half_faces.count(OppositeHalfFace(face)), 0u);
    }
  }
}

TEST(Assembly, CellsNeverFillMoreThanTheGrid) {
  for (uint32_t seed = 0; seed < 20; ++seed) {
    const Extraction extraction = seed % 2 == 0 ? Extraction::kDirect : Extraction::kPaper;
    const CellComplex complex = Assembled(JitteredGrid(seed), ParamsFor(extraction));
    EXPECT_LE(VolumeOf(complex), 64.0 + 1e-9);
  }
}

// True if a cell of the complex uses one of the faces from the same side, lies behind the hull
// there, or overlaps.
bool IsInConflict(const CellCorners& cell, const CellComplex& complex) {
  const std::multiset<CellFace> used = HalfFacesOf(complex);
  const std::set<CellFace> hull = HullOf(complex);
  for (const CellFace& face : FacesOf(cell)) {
    if (used.count(CanonicalHalfFace(face)) > 0 || hull.count(OppositeHalfFace(face)) > 0) {
      return true;
    }
  }
  const CellBody body(cell, complex.vertices);
  return std::any_of(complex.cells.begin(), complex.cells.end(), [&](const CellCorners& other) {
    return Overlap(body, CellBody(other, complex.vertices));
  });
}

TEST(Assembly, LeavesADirectCellOutOnlyForAConflict) {
  for (uint32_t seed = 0; seed < 10; ++seed) {
    const MergedCubes grid = JitteredGrid(seed);
    const CellComplex complex = Assembled(grid);
    const std::set<CellCorners> chosen(complex.cells.begin(), complex.cells.end());
    for (const CellCorners& cube : grid.corners) {
      if (CellQuality(cube, grid.vertices) <= MeshingParams{}.assembly.min_quality) continue;
      EXPECT_TRUE(chosen.count(cube) > 0 || IsInConflict(cube, complex));
    }
  }
}

TEST(Assembly, AMeshWithoutAnyHexahedronIsAssembledFromItsPrisms) {
  // Every cube of the grid collapses two parallel edges of one face.
  MergedCubes cubes = MakeCubeGrid(1, 1, 3);
  for (CellCorners& corners : cubes.corners) {
    corners[3] = corners[2];
    corners[7] = corners[6];
  }
  const CellComplex complex = Assembled(cubes);
  EXPECT_EQ(complex.cells.size(), 3u);
  EXPECT_TRUE(OpenFacesOf(complex).empty());
}

TEST(Assembly, DoesNotDependOnTheNumberOfThreads) {
  for (const Extraction extraction : {Extraction::kDirect, Extraction::kPaper}) {
    const MergedCubes grid = JitteredGrid(3);
    std::vector<CellComplex> complexes;
    for (const size_t threads : {1, 4}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      complexes.push_back(Assembled(grid, ParamsFor(extraction)));
    }
    EXPECT_EQ(complexes[0].cells, complexes[1].cells);
    EXPECT_EQ(complexes[0].hull_faces, complexes[1].hull_faces);
  }
}

TEST(ExtractTopology, NamesTheCornerThatIsNoVertex) {
  MergedCubes cubes = MakeCubeGrid(1, 1, 1);
  cubes.corners[0][3] = 99;
  RunContext context;
  const auto table = ExtractTopology(cubes, MeshingParams{}, context);
  EXPECT_EQ(table.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(std::string(table.status().message()).find("99"), std::string::npos);
}

TEST(ExtractTopology, ACancelledRunEndsWithCancelled) {
  RunContext context;
  context.RequestStop();
  for (const Extraction extraction : {Extraction::kDirect, Extraction::kPaper}) {
    EXPECT_EQ(
        ExtractTopology(MakeCubeGrid(2, 2, 2), ParamsFor(extraction), context).status().code(),
        absl::StatusCode::kCancelled);
  }
}

}  // namespace
}  // namespace amhex
