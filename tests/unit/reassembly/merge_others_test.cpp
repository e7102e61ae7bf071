// Laws of merging what is no hexahedron: cells become fewer and larger where their vertices admit
// it, the complex fills what it filled and stays closed, and creases and hexahedra stay.
#include "reassembly/merge_others.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "closure/working_mesh.h"
#include "fixtures/damage.h"
#include "optimize/cell_quality.h"
#include "optimize/raise_quality.h"
#include "output/validate.h"
#include "support/grid_complex.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridSize;
using testing_support::ListHullFaces;
using testing_support::MeshOf;

constexpr double kSharpAngle = 35;
// As merge_others.h tells.
constexpr double kLeastQuality = 0.2;

CellComplex Merged(const CellComplex& complex, double sharp_angle = kSharpAngle) {
  RunContext run;
  auto merged = MergeOthers(complex, sharp_angle, run);
  EXPECT_TRUE(merged.ok()) << merged.status().ToString();
  return *merged;
}

double VolumeOf(const CellComplex& complex) {
  double volume = 0;
  for (const CellCorners& cell : complex.cells) volume += CellVolume(cell, complex.vertices);
  return volume;
}

int CountHexahedra(const CellComplex& complex) {
  int count = 0;
  for (const CellCorners& cell : complex.cells) {
    if (RecognizeCell(cell) == PrimitiveType::kHexahedron) ++count;
  }
  return count;
}

// The cell as six pyramids around its middle.
void BreakIntoPyramids(size_t cell, CellComplex* complex) {
  const CellCorners corners = complex->cells[cell];
  Vec3d middle;
  for (const int32_t v : corners) middle += complex->vertices[v] / 8.0;
  const auto apex = static_cast<int32_t>(complex->vertices.size());
  complex->vertices.push_back(middle);
  complex->cells.erase(complex->cells.begin() + static_cast<int64_t>(cell));
  for (const CellFace& face : FacesOf(corners)) {
    const auto& v = face.v;
    complex->cells.push_back({v[0], apex, apex, v[3], v[1], apex, apex, v[2]});
  }
}

// A unit cube as two prisms, whose edge in the middle of its roof is raised so that the roof's two
// triangles are folded by so many degrees.
CellComplex Roof(double degrees) {
  CellComplex complex;
  complex.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                      {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  // Half the diagonal lies between the raised edge and the corners beside it.
  const double rise = std::tan(degrees / 2 * std::numbers::pi / 180) * std::numbers::sqrt2 / 2;
  complex.vertices[4].z += rise;
  complex.vertices[6].z += rise;
  complex.cells = {{0, 1, 1, 2, 4, 5, 5, 6}, {0, 2, 2, 3, 4, 6, 6, 7}};
  ListHullFaces(complex);
  return complex;
}

TEST(MergeOthers, MakesTheHexahedronThatAnEvenStarFills) {
  const CellComplex grid = GridComplex({3, 3, 3});
  CellComplex broken = grid;
  BreakIntoPyramids(13, &broken);  // in the middle
  ListHullFaces(broken);
  ASSERT_EQ(broken.cells.size(), 26U + 6U);
  const CellComplex merged = Merged(broken);
  EXPECT_EQ(merged.cells.size(), 27U);
  EXPECT_EQ(CountHexahedra(merged), 27);
  for (size_t c = 0; c < 26; ++c) EXPECT_EQ(merged.cells[c], broken.cells[c]) << "in their order";
  EXPECT_NEAR(VolumeOf(merged), 27, 1e-12);
}

TEST(MergeOthers, MergesOverAFlatRoofAndAlongNoCrease) {
  EXPECT_EQ(CountHexahedra(Merged(Roof(0))), 1);
  EXPECT_EQ(CountHexahedra(Merged(Roof(25))), 1);
  EXPECT_EQ(Merged(Roof(40)).cells, Roof(40).cells);
  EXPECT_EQ(Merged(Roof(25), 25).cells, Roof(25).cells) << "where flatter creases are kept, too";
}

TEST(MergeOthers, TakesTheSliverOnARoofAlong) {
  // The roof folds down along one diagonal, and the sliver on it folds up along the other one.
  CellComplex complex = Roof(-20);
  complex.cells.push_back({4, 5, 5, 6, 7, 7, 7, 7});
  ListHullFaces(complex);
  ASSERT_TRUE(WorkingMesh(complex).OpenFaces().empty());
  const CellComplex merged = Merged(complex);
  EXPECT_TRUE(WorkingMesh(merged).OpenFaces().empty());
  EXPECT_EQ(merged.cells.size(), 1U);
  EXPECT_EQ(CountHexahedra(merged), 1);
}

TEST(MergeOthers, LeavesAComplexOfHexahedraAsItIs) {
  const CellComplex grid = GridComplex({3, 2, 2});
  const CellComplex merged = Merged(grid);
  EXPECT_EQ(merged.cells, grid.cells);
  EXPECT_EQ(merged.vertices, grid.vertices);
  EXPECT_EQ(merged.hull_faces.size(), grid.hull_faces.size());
}

TEST(MergeOthers, KeepsComplexesClosedAndCellsGood) {
  fixtures::Chance chance(5);
  int saved = 0;
  for (int trial = 0; trial < 50; ++trial) {
    CellComplex complex = GridComplex({4, 4, 4});
    for (size_t i = complex.cells.size(); i-- > 0;) {
      if (chance.Below(3) == 0) BreakIntoPyramids(i, &complex);
    }
    for (Vec3d& vertex : complex.vertices) {
      const auto shift = [&] {
        return 0.3 * (static_cast<double>(chance.Below(1000)) / 999 - 0.5);
      };
      vertex += Vec3d{shift(), shift(), shift()};
    }
    ListHullFaces(complex);
    const double least = SummarizeQuality(complex).minimum;
    const CellComplex merged = Merged(complex);
    EXPECT_TRUE(WorkingMesh(merged).OpenFaces().empty());
    EXPECT_LE(merged.cells.size(), complex.cells.size());
    EXPECT_GE(CountHexahedra(merged), CountHexahedra(complex));
    EXPECT_GE(SummarizeQuality(merged).minimum, std::min(least, kLeastQuality));
    EXPECT_EQ(merged.vertices, complex.vertices);
    const ValidationReport before = ValidateMesh(MeshOf(complex));
    const ValidationReport after = ValidateMesh(MeshOf(merged));
    EXPECT_EQ(after.valid(), before.valid()) << after.Summary();
    saved += static_cast<int>(complex.cells.size() - merged.cells.size());
  }
  EXPECT_GT(saved, 1000);
}

TEST(MergeOthers, IsCancelled) {
  RunContext run;
  run.RequestStop();
  EXPECT_EQ(MergeOthers(Roof(0), kSharpAngle, run).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace amhex
