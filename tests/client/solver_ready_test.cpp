#include "cells/solver_ready.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "cells/boundary.h"
#include "cells/cell_division.h"
#include "cells/mesh_check.h"
#include "test_cells.h"

namespace amhex::client {
namespace {

using ::testing::HasSubstr;

bool IsForSolvers(PrimitiveType type) {
  return type != PrimitiveType::kSlice && type != PrimitiveType::kHexprism;
}

double VolumeOf(const AtMostHexaMesh& mesh) {
  double sum = 0;
  for (const CellCorners& corners : mesh.corners) sum += VolumeOfCell(corners, mesh.vertices);
  return sum;
}

AtMostHexaMesh MeshOf(const Division& division, std::vector<Vec3d> vertices) {
  AtMostHexaMesh mesh;
  mesh.vertices = std::move(vertices);
  const auto centre = static_cast<int32_t>(mesh.vertices.size());
  if (division.has_centre) mesh.vertices.push_back(division.centre);
  for (CellCorners corners : division.cells) {
    std::replace(corners.begin(), corners.end(), kCentreVertex, centre);
    mesh.corners.push_back(corners);
    mesh.types.push_back(TypeOfCell(corners).value_or(PrimitiveType::kSlice));
    mesh.quality.push_back(0);
  }
  return mesh;
}

// The faces as sets of vertices.
using FaceSet = std::set<std::set<int32_t>>;

FaceSet HullOf(const AtMostHexaMesh& mesh) {
  FaceSet faces;
  const auto boundary = BoundaryOf(mesh, {});
  EXPECT_TRUE(boundary.ok()) << boundary.status();
  if (!boundary.ok()) return faces;
  for (const BoundaryFace& b : *boundary) {
    faces.insert({b.face.vertex.begin(), b.face.vertex.begin() + b.face.count});
  }
  return faces;
}

// What the faces of a cell must have become, worked out from vertex numbers alone. Where both
// quadrilaterals of a slice are split beside their common vertex, they have a triangle in common:
// there the cells on both sides of the slice meet, and the slice loses it.
FaceSet SplitFacesOf(const FaceList& faces, const FaceDiagonals& diagonals) {
  FaceSet expected;
  for (int f = 0; f < faces.count; ++f) {
    const Face& face = faces.face[f];
    const std::set<int32_t> all(face.vertex.begin(), face.vertex.begin() + face.count);
    if (diagonals[f] == Diagonal::kNone) {
      expected.insert(all);
      continue;
    }
    // Every split leaves out one of two opposite vertices.
    for (int i = 0; i < 4; ++i) {
      const int32_t left_out = face.vertex[i], opposite = face.vertex[(i + 2) % 4];
      const bool least = left_out == *all.begin() || opposite == *all.begin();
      if (least == (diagonals[f] == Diagonal::kThroughLeast)) continue;
      std::set<int32_t> triangle = all;
      triangle.erase(left_out);
      if (!expected.insert(triangle).second) expected.erase(triangle);
    }
  }
  return expected;
}

// Calls `visit` for every way to split the cell's quadrilaterals.
template <class Visit>
int ForEachDiagonals(const FaceList& faces, const Visit& visit) {
  int combinations = 1, visited = 0;
  for (const Face& face : faces) combinations *= face.count == 4 ? 3 : 1;
  for (int code = 0; code < combinations; ++code, ++visited) {
    FaceDiagonals diagonals{};
    int rest = code;
    for (int f = 0; f < faces.count; ++f) {
      if (faces.face[f].count != 4) continue;
      diagonals[f] = static_cast<Diagonal>(rest % 3);
      rest /= 3;
    }
    visit(diagonals);
  }
  return visited;
}

TEST(CellDivision, FitsEveryWayToSplitTheFacesOfEveryType) {
  const std::map<PrimitiveType, int> ways = {
      {PrimitiveType::kHexahedron, 729}, {PrimitiveType::kHexprism, 81},
      {PrimitiveType::kPrism, 27},       {PrimitiveType::kSlice, 9},
      {PrimitiveType::kPyramid, 3},      {PrimitiveType::kTetrahedron, 1}};
  for (PrimitiveType type : kPrimitiveTypes) {
    const AtMostHexaMesh cell = OneCell(type);
    const FaceList faces = FacesOfCell(cell.corners[0]);
    const int visited = ForEachDiagonals(faces, [&](const FaceDiagonals& diagonals) {
      const Division division = DivideCell(cell.corners[0], cell.vertices, diagonals);
      // Such divisions are never taken.
      if (type == PrimitiveType::kSlice && division.quality <= 0) return;
      const AtMostHexaMesh mesh = MeshOf(division, cell.vertices);
      EXPECT_EQ(HullOf(mesh), SplitFacesOf(faces, diagonals)) << PrimitiveName(type);
      for (PrimitiveType part : mesh.types) EXPECT_TRUE(IsForSolvers(part));
      if (type == PrimitiveType::kSlice) return;
      EXPECT_GT(division.quality, 0.05) << PrimitiveName(type);
      EXPECT_TRUE(CheckMesh(mesh).ok()) << PrimitiveName(type) << ": " << CheckMesh(mesh);
    });
    EXPECT_EQ(visited, ways.at(type)) << PrimitiveName(type);
  }
}

TEST(CellDivision, KeepsTheVolumeOfCellsWithFlatFaces) {
  for (PrimitiveType type : {PrimitiveType::kHexahedron, PrimitiveType::kPrism,
                             PrimitiveType::kPyramid, PrimitiveType::kTetrahedron}) {
    const AtMostHexaMesh cell = OneCell(type);
    ForEachDiagonals(FacesOfCell(cell.corners[0]), [&](const FaceDiagonals& diagonals) {
      const Division division = DivideCell(cell.corners[0], cell.vertices, diagonals);
      EXPECT_NEAR(VolumeOf(MeshOf(division, cell.vertices)), VolumeOf(cell), 1e-12);
    });
  }
}

// The vertex between the slice's two quadrilaterals has two edges, so that a pyramid over one of
// them is right exactly where one over the other is inside out.
TEST(CellDivision, OfASliceNeedsOneOfItsQuadrilateralsSplit) {
  const AtMostHexaMesh slice = OneCell(PrimitiveType::kSlice);
  int good = 0;
  ForEachDiagonals(FacesOfCell(slice.corners[0]), [&](const FaceDiagonals& diagonals) {
    const Division division = DivideCell(slice.corners[0], slice.vertices, diagonals);
    if (diagonals == FaceDiagonals{}) {
      EXPECT_LE(division.quality, 0);
    }
    if (division.quality > 0) ++good;
  });
  EXPECT_GE(good, 2);
}

TEST(CellDivision, OfAHexprismAloneIsAPrismAndAPyramidOrTwoPyramids) {
  const AtMostHexaMesh cell = OneCell(PrimitiveType::kHexprism);
  const auto sets = HexprismDiagonals(FacesOfCell(cell.corners[0]));
  const auto types = [&](const FaceDiagonals& diagonals) {
    std::multiset<PrimitiveType> found;
    const Division division = DivideCell(cell.corners[0], cell.vertices, diagonals);
    EXPECT_FALSE(division.has_centre);
    for (PrimitiveType type : MeshOf(division, cell.vertices).types) found.insert(type);
    return found;
  };
  EXPECT_EQ(types(sets[0]),
            (std::multiset<PrimitiveType>{PrimitiveType::kPyramid, PrimitiveType::kPyramid}));
  EXPECT_EQ(types(sets[1]),
            (std::multiset<PrimitiveType>{PrimitiveType::kPyramid, PrimitiveType::kPrism}));
}

// Collapses random edges of a block of cubes, as long as every cell stays one of the six.
class RandomMeshes {
 public:
  explicit RandomMeshes(uint32_t seed) : random_(seed) {}

  AtMostHexaMesh Next(int n, int collapses) {
    AtMostHexaMesh mesh = Block(n, 0);
    for (Vec3d& v : mesh.vertices) {
      for (int axis = 0; axis < 3; ++axis) v[axis] += 0.1 / n * Uniform();
    }
    for (int done = 0, tries = 0; done < collapses && tries < 200 * collapses; ++tries) {
      const CellCorners& cell = mesh.corners[random_() % mesh.corners.size()];
      const int32_t keep = cell[random_() % 8], gone = cell[random_() % 8];
      if (TryCollapse(keep, gone, &mesh)) ++done;
    }
    mesh.types.clear(), mesh.quality.clear();
    for (const CellCorners& corners : mesh.corners) {
      mesh.types.push_back(*TypeOfCell(corners));
      mesh.quality.push_back(static_cast<float>(ScaledJacobianOfCell(corners, mesh.vertices)));
    }
    return mesh;
  }

 private:
  double Uniform() { return std::uniform_real_distribution<double>(-1, 1)(random_); }

  bool TryCollapse(int32_t keep, int32_t gone, AtMostHexaMesh* mesh) {
    if (keep == gone) return false;
    AtMostHexaMesh trial = *mesh;
    trial.vertices[keep] = (trial.vertices[keep] + trial.vertices[gone]) * 0.5;
    for (CellCorners& corners : trial.corners) {
      std::replace(corners.begin(), corners.end(), gone, keep);
    }
    trial.types.clear();
    for (const CellCorners& corners : trial.corners) {
      const auto type = TypeOfCell(corners);
      if (!type || ScaledJacobianOfCell(corners, trial.vertices) < 0.1) return false;
      trial.types.push_back(*type);
    }
    if (!CheckMesh(trial).ok()) return false;
    *mesh = std::move(trial);
    return true;
  }

  std::mt19937 random_;
};

TEST(SolverReady, MakesEveryRandomMeshConformingAndOfFourTypes) {
  int64_t hexprisms = 0, slices = 0;
  for (uint32_t seed = 1; seed <= 40; ++seed) {
    const AtMostHexaMesh mesh = RandomMeshes(seed).Next(3, 1 + static_cast<int>(seed % 6));
    hexprisms += std::count(mesh.types.begin(), mesh.types.end(), PrimitiveType::kHexprism);
    slices += std::count(mesh.types.begin(), mesh.types.end(), PrimitiveType::kSlice);
    const auto ready = MakeSolverReady(mesh);
    ASSERT_TRUE(ready.ok()) << "seed " << seed << ": " << ready.status();
    EXPECT_TRUE(CheckMesh(*ready).ok()) << "seed " << seed << ": " << CheckMesh(*ready);
    for (size_t cell = 0; cell < ready->corners.size(); ++cell) {
      EXPECT_TRUE(IsForSolvers(ready->types[cell]));
      EXPECT_GT(ScaledJacobianOfCell(ready->corners[cell], ready->vertices), 0);
    }
    EXPECT_NEAR(VolumeOf(*ready), VolumeOf(mesh), 0.05 * VolumeOf(mesh));
    for (size_t v = 0; v < mesh.vertices.size(); ++v) {
      EXPECT_EQ(mesh.vertices[v], ready->vertices[v]);
    }
  }
  EXPECT_GT(hexprisms, 50);
  EXPECT_GT(slices, 0);
}

TEST(SolverReady, LeavesAMeshAloneThatHasNoOtherCells) {
  const AtMostHexaMesh mesh = Block(3, 2);
  const auto ready = MakeSolverReady(mesh);
  ASSERT_TRUE(ready.ok()) << ready.status();
  EXPECT_EQ(ready->corners, mesh.corners);
  EXPECT_EQ(ready->vertices, mesh.vertices);
}

TEST(SolverReady, GivesTheSameMeshAgain) {
  const AtMostHexaMesh mesh = RandomMeshes(4).Next(3, 5);
  const auto first = MakeSolverReady(mesh), second = MakeSolverReady(mesh);
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(first->corners, second->corners);
  EXPECT_EQ(first->vertices, second->vertices);
}

TEST(SolverReady, DividesEveryTypeStandingAlone) {
  const auto ready = MakeSolverReady(OneOfEach());
  ASSERT_TRUE(ready.ok()) << ready.status();
  EXPECT_TRUE(CheckMesh(*ready).ok()) << CheckMesh(*ready);
  for (PrimitiveType type : ready->types) EXPECT_TRUE(IsForSolvers(type));
}

TEST(SolverReady, NamesTheCellThatCannotBeDivided) {
  AtMostHexaMesh mesh = OneCell(PrimitiveType::kSlice);
  mesh.vertices[2] = {1, 0, 1};  // flat
  const auto ready = MakeSolverReady(mesh);
  ASSERT_FALSE(ready.ok());
  EXPECT_EQ(ready.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(ready.status().message()), HasSubstr("cell 0 (slice"));
}

TEST(SolverReady, RefusesCellsThatDoNotFitTogether) {
  AtMostHexaMesh mesh = OneCell(PrimitiveType::kHexahedron);
  mesh.corners.push_back(mesh.corners[0]);
  mesh.types.push_back(mesh.types[0]);
  mesh.quality.push_back(1);
  EXPECT_EQ(MakeSolverReady(mesh).status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace amhex::client
