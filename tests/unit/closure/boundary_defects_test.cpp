// Where the boundary of a mesh is no surface, dips into the mesh or leaves the hull.
#include "closure/boundary_defects.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "input/hull_queries.h"
#include "support/grid_complex.h"

namespace amhex {
namespace {

using testing_support::AddBeside;
using testing_support::GridComplex;
using testing_support::GridSize;
using testing_support::ListHullFaces;
using testing_support::NotchedGrid;

// The complex's own boundary.
Hull HullOf(const CellComplex& complex) {
  Hull hull;
  hull.vertices = complex.vertices;
  for (const CellFace& face : complex.hull_faces) {
    hull.triangles.push_back({face.v[0], face.v[1], face.v[2]});
    if (face.count == 4) hull.triangles.push_back({face.v[0], face.v[2], face.v[3]});
  }
  hull.queries = std::make_shared<HullQueries>(hull.vertices, hull.triangles);
  return hull;
}

BoundaryDefects DefectsOf(const CellComplex& complex, const Hull& hull) {
  return FindBoundaryDefects(WorkingMesh(complex), hull);
}
BoundaryDefects DefectsOf(const CellComplex& complex) {
  return DefectsOf(complex, HullOf(complex));
}

// About half of the cubes of a grid, whose vertices and cells have any numbers.
CellComplex RandomCubes(std::mt19937_64& random) {
  const GridSize size{4, 4, 4};
  CellComplex complex = GridComplex(size);
  std::vector<int32_t> number(complex.vertices.size());
  std::iota(number.begin(), number.end(), 0);
  std::shuffle(number.begin(), number.end(), random);
  std::vector<Vec3d> vertices(number.size());
  for (size_t v = 0; v < number.size(); ++v) {
    vertices[static_cast<size_t>(number[v])] = complex.vertices[v];
  }
  complex.vertices = std::move(vertices);
  std::shuffle(complex.cells.begin(), complex.cells.end(), random);
  complex.cells.resize(complex.cells.size() / 2);
  for (CellCorners& cell : complex.cells) {
    for (int32_t& v : cell) v = number[static_cast<size_t>(v)];
  }
  ListHullFaces(complex);
  return complex;
}

std::vector<int32_t> Sorted(const std::set<int32_t>& vertices) {
  return {vertices.begin(), vertices.end()};
}

// Vertices of edges with more than two faces, and those where walking from face to face over edges
// does not come to all faces at the vertex.
std::vector<int32_t> NoSurfaceAt(const CellComplex& complex) {
  std::map<std::pair<int32_t, int32_t>, std::vector<size_t>> faces_of_edge;
  std::map<int32_t, std::set<size_t>> faces_at;
  for (size_t f = 0; f < complex.hull_faces.size(); ++f) {
    const CellFace& face = complex.hull_faces[f];
    for (int j = 0; j < face.count; ++j) {
      faces_of_edge[std::minmax(face.v[j], face.v[(j + 1) % face.count])].push_back(f);
      faces_at[face.v[j]].insert(f);
    }
  }
  std::set<int32_t> found;
  for (const auto& [edge, faces] : faces_of_edge) {
    if (faces.size() != 2) found.insert({edge.first, edge.second});
  }
  for (const auto& [vertex, faces] : faces_at) {
    std::set<size_t> reached = {*faces.begin()};
    for (size_t before = 0; before < reached.size();) {
      before = reached.size();
      for (const auto& [edge, sides] : faces_of_edge) {
        if (edge.first != vertex && edge.second != vertex) continue;
        for (const size_t side : sides) {
          if (reached.count(side) > 0) reached.insert(sides.begin(), sides.end());
        }
      }
    }
    if (reached != faces) found.insert(vertex);
  }
  return Sorted(found);
}

TEST(BoundaryDefects, AreWhereABoundaryOfCubesIsNoSurface) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 200; ++i) {
    const CellComplex complex = RandomCubes(random);
    ASSERT_EQ(DefectsOf(complex).vertices, NoSurfaceAt(complex)) << i;
  }
}

// Prisms around an axis, in any order; some of them, or all.
CellComplex SectorsOfADisc(int of_all, int count, std::mt19937_64& random) {
  CellComplex complex;
  complex.vertices = {{0, 0, 0}, {0, 0, 1}};
  for (int i = 0; i < of_all; ++i) {
    const double angle = 2 * std::numbers::pi * i / of_all;
    for (const double z : {0.0, 1.0}) {
      complex.vertices.push_back({std::cos(angle), std::sin(angle), z});
    }
  }
  for (int i = 0; i < of_all; ++i) {
    const int32_t a = 2 + 2 * i, b = 2 + 2 * ((i + 1) % of_all);
    complex.cells.push_back({0, a, a, b, 1, a + 1, a + 1, b + 1});
  }
  std::shuffle(complex.cells.begin(), complex.cells.end(), random);
  complex.cells.resize(static_cast<size_t>(count));
  ListHullFaces(complex);
  return complex;
}

TEST(BoundaryDefects, AreNoneHoweverManyFacesMeetInOneSheet) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 400; ++i) {
    const int of_all = 3 + i % 10;
    EXPECT_TRUE(DefectsOf(SectorsOfADisc(of_all, of_all, random)).vertices.empty()) << i;
    const CellComplex some = SectorsOfADisc(of_all, of_all / 2 + 1, random);
    EXPECT_EQ(DefectsOf(some).vertices, NoSurfaceAt(some)) << i;
  }
}

// Two blocks that share no vertex.
CellComplex TwoBlocks(const Vec3d& apart) {
  CellComplex complex = GridComplex({2, 2, 2});
  AddBeside(GridComplex({2, 2, 2}), apart, complex);
  return complex;
}

TEST(BoundaryDefects, AreWhereTheMeshDipsIntoItself) {
  EXPECT_TRUE(DefectsOf(TwoBlocks({2.1, 0.1, 0.1})).vertices.empty());
  const CellComplex complex = TwoBlocks({1.9, 0.1, 0.1});
  const BoundaryDefects defects = DefectsOf(complex);
  EXPECT_FALSE(defects.are_just_far);
  // Of either block the side in the other one, whose middle dips deepest.
  const auto is_defect = [&](const Vec3d& p) {
    return std::any_of(defects.vertices.begin(), defects.vertices.end(), [&](int32_t v) {
      return Norm(complex.vertices[static_cast<size_t>(v)] - p) < 1e-9;
    });
  };
  EXPECT_TRUE(is_defect({2, 1, 1}));
  EXPECT_TRUE(is_defect({1.9, 1.1, 1.1}));
  for (const int32_t v : defects.vertices) {
    EXPECT_NEAR(complex.vertices[static_cast<size_t>(v)].x, 2, 1.01) << v;
  }
}

TEST(BoundaryDefects, AreAtSlitsAndNotAtNotches) {
  EXPECT_TRUE(DefectsOf(NotchedGrid(0.2)).vertices.empty());
  // The two quads on either side of the slit have five vertices.
  EXPECT_EQ(DefectsOf(NotchedGrid(0.1)).vertices.size(), 5U);
}

TEST(BoundaryDefects, NearMovedVerticesAreThoseThatMovingThemMade) {
  const CellComplex complex = TwoBlocks({1.9, 0.1, 0.1});
  const std::vector<int32_t> all = DefectsOf(complex).vertices;
  const Hull hull = HullOf(complex);
  EXPECT_EQ(FindBoundaryDefectsNear({all.front()}, complex, hull).vertices, all);
  EXPECT_TRUE(FindBoundaryDefectsNear({}, complex, hull).vertices.empty());
  // A third block, far away.
  CellComplex three = complex;
  const auto first = static_cast<int32_t>(three.vertices.size());
  AddBeside(GridComplex({2, 2, 2}), {20, 0, 0}, three);
  EXPECT_FALSE(DefectsOf(three).vertices.empty());
  EXPECT_TRUE(FindBoundaryDefectsNear({first}, three, HullOf(three)).vertices.empty());
  EXPECT_EQ(FindBoundaryDefectsNear({first, all.front()}, three, HullOf(three)).vertices, all);
}

TEST(BoundaryDefects, AreWhereALayerOfCellsIsMissing) {
  const Hull hull = HullOf(GridComplex({4, 4, 4}));
  CellComplex complex = GridComplex({4, 4, 4});
  EXPECT_TRUE(DefectsOf(complex, hull).vertices.empty());
  std::set<int32_t> top;
  for (size_t v = 0; v < complex.vertices.size(); ++v) {
    if (complex.vertices[v].z == 3) top.insert(static_cast<int32_t>(v));
  }
  std::erase_if(complex.cells, [&](const CellCorners& cell) {
    return complex.vertices[static_cast<size_t>(cell[4])].z == 4;
  });
  ListHullFaces(complex);
  const BoundaryDefects defects = DefectsOf(complex, hull);
  EXPECT_TRUE(defects.are_just_far);
  // Those of the faces in the middle, which are farther from the sides, too.
  std::set<int32_t> middle;
  for (const int32_t v : top) {
    const Vec3d& p = complex.vertices[static_cast<size_t>(v)];
    if (p.x >= 1 && p.x <= 3 && p.y >= 1 && p.y <= 3) middle.insert(v);
  }
  EXPECT_EQ(defects.vertices, Sorted(middle));
}

}  // namespace
}  // namespace amhex
