// Complexes and meshes made by code, with every cell and every hull face known.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "amhex/volume_mesh.h"
#include "assembly/cell_complex.h"
#include "output/finalize_mesh.h"
#include "topology/primitives.h"

namespace amhex::testing_support {

// Unit cubes on [0, nx] x [0, ny] x [0, nz]; vertex (x, y, z) has the id GridVertex gives.
struct GridSize {
  int nx, ny, nz;
};
inline int32_t GridVertex(const GridSize& n, int x, int y, int z) {
  return (z * (n.ny + 1) + y) * (n.nx + 1) + x;
}
inline CellCorners GridCell(const GridSize& n, int x, int y, int z) {
  return {GridVertex(n, x, y, z),
          GridVertex(n, x + 1, y, z),
          GridVertex(n, x + 1, y + 1, z),
          GridVertex(n, x, y + 1, z),
          GridVertex(n, x, y, z + 1),
          GridVertex(n, x + 1, y, z + 1),
          GridVertex(n, x + 1, y + 1, z + 1),
          GridVertex(n, x, y + 1, z + 1)};
}

// Lists every face that only one cell has.
inline void ListHullFaces(CellComplex& complex) {
  std::vector<std::pair<std::array<int32_t, 4>, CellFace>> faces;
  for (const CellCorners& corners : complex.cells) {
    for (const CellFace& face : FacesOf(corners)) {
      std::array<int32_t, 4> key = face.v;
      std::sort(key.begin(), key.end());
      faces.push_back({key, face});
    }
  }
  std::stable_sort(faces.begin(), faces.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  complex.hull_faces.clear();
  for (size_t i = 0; i < faces.size(); ++i) {
    const bool as_before = i > 0 && faces[i - 1].first == faces[i].first;
    const bool as_after = i + 1 < faces.size() && faces[i + 1].first == faces[i].first;
    if (!as_before && !as_after) complex.hull_faces.push_back(faces[i].second);
  }
}

inline CellComplex GridComplex(const GridSize& n) {
  CellComplex complex;
  for (int z = 0; z <= n.nz; ++z) {
    for (int y = 0; y <= n.ny; ++y) {
      for (int x = 0; x <= n.nx; ++x) {
        complex.vertices.push_back({double(x), double(y), double(z)});
      }
    }
  }
  for (int z = 0; z < n.nz; ++z) {
    for (int y = 0; y < n.ny; ++y) {
      for (int x = 0; x < n.nx; ++x) complex.cells.push_back(GridCell(n, x, y, z));
    }
  }
  ListHullFaces(complex);
  return complex;
}

// Eight unit cubes; the two at the top of the front are parted by a notch, so wide at the edge
// between top and front, that runs out to nothing at the cubes below and behind.
inline CellComplex NotchedGrid(double width) {
  constexpr GridSize kSize{2, 2, 2};
  CellComplex complex = GridComplex(kSize);
  const int32_t left = GridVertex(kSize, 1, 0, 2);
  const auto right = static_cast<int32_t>(complex.vertices.size());
  complex.vertices.push_back(complex.vertices[static_cast<size_t>(left)]);
  complex.vertices[static_cast<size_t>(left)].x -= width / 2;
  complex.vertices[static_cast<size_t>(right)].x += width / 2;
  const CellCorners cube = GridCell(kSize, 1, 0, 1);
  CellCorners& parted = *std::find(complex.cells.begin(), complex.cells.end(), cube);
  std::replace(parted.begin(), parted.end(), left, right);
  ListHullFaces(complex);
  return complex;
}

// Adds another complex's cells beside its own, moved; they share no vertex.
inline void AddBeside(const CellComplex& other, const Vec3d& by, CellComplex& complex) {
  const auto first = static_cast<int32_t>(complex.vertices.size());
  for (const Vec3d& p : other.vertices) complex.vertices.push_back(p + by);
  for (CellCorners cell : other.cells) {
    for (int32_t& v : cell) v += first;
    complex.cells.push_back(cell);
  }
  ListHullFaces(complex);
}

// Moves every vertex by up to `amount` along each axis; the same moves at every call.
inline void Shake(CellComplex& complex, double amount) {
  std::minstd_rand random(20240607);
  const auto next = [&] {
    return amount * (2.0 * random() / static_cast<double>(std::minstd_rand::max()) - 1.0);
  };
  for (Vec3d& p : complex.vertices) p += Vec3d{next(), next(), next()};
}

inline AtMostHexaMesh MeshOf(const CellComplex& complex) { return FinalizeMesh(complex, Frame{}); }

// The 8-corner lists of Figure 2 (both pyramids) on the corners of a unit cube.
struct SinglePattern {
  const char* name;
  PrimitiveType type;
  CellCorners cube_corners;
};
inline constexpr SinglePattern kSinglePatterns[] = {
    {"hexahedron", PrimitiveType::kHexahedron, {0, 1, 2, 3, 4, 5, 6, 7}},
    {"hexprism", PrimitiveType::kHexprism, {0, 1, 1, 3, 4, 5, 6, 7}},
    {"prism", PrimitiveType::kPrism, {0, 1, 1, 3, 4, 5, 5, 7}},
    {"slice", PrimitiveType::kSlice, {0, 1, 1, 3, 4, 5, 5, 4}},
    {"pyramid, form a", PrimitiveType::kPyramid, {0, 1, 1, 3, 0, 5, 5, 7}},
    {"pyramid, form b", PrimitiveType::kPyramid, {0, 1, 1, 3, 4, 1, 1, 7}},
    {"tetrahedron", PrimitiveType::kTetrahedron, {0, 1, 1, 3, 0, 5, 5, 3}},
};

// One cell of the pattern.
inline CellComplex SingleCell(const CellCorners& cube_corners) {
  CellComplex complex;
  complex.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                      {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  complex.cells = {cube_corners};
  ListHullFaces(complex);
  return complex;
}

// The cell with a pyramid on each of its quads and a tetrahedron on each of its triangles.
inline CellComplex StellatedCell(const CellCorners& cube_corners) {
  CellComplex complex = SingleCell(cube_corners);
  for (const CellFace& face : FacesOf(cube_corners)) {
    Vec3d middle;
    for (int j = 0; j < face.count; ++j) middle += complex.vertices[face.v[j]] / face.count;
    const Vec3d& a = complex.vertices[face.v[0]];
    const Vec3d& b = complex.vertices[face.v[1]];
    const Vec3d& c = complex.vertices[face.v[2]];
    const Vec3d across = face.count == 4 ? complex.vertices[face.v[3]] - b : c - a;
    const Vec3d normal = Normalized(face.count == 4 ? Cross(c - a, across) : Cross(b - a, across));
    const int32_t apex = static_cast<int32_t>(complex.vertices.size());
    complex.vertices.push_back(middle + normal * 0.4);
    if (face.count == 4) {
      complex.cells.push_back(MakePyramid({face.v[3], face.v[2], face.v[1], face.v[0]}, apex));
    } else {
      complex.cells.push_back(MakeTetrahedronOn({face.v[2], face.v[1], face.v[0]}, apex));
    }
  }
  ListHullFaces(complex);
  return complex;
}

}  // namespace amhex::testing_support
