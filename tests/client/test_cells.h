// Small meshes for the tests: one cell of each type, and a block of all that fit together.
#pragma once

#include <string>
#include <vector>

#include "amhex/volume_mesh.h"
#include "cells/cells.h"

namespace amhex::client {

// A mesh of one cell: the unit cube's corners in the pattern of `type`, with the vertices that the
// pattern leaves, numbered by first appearance and placed so that the cell is well shaped.
inline AtMostHexaMesh OneCell(PrimitiveType type) {
  AtMostHexaMesh mesh;
  switch (type) {
    case PrimitiveType::kHexahedron:
      mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                       {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
      mesh.corners = {{0, 1, 2, 3, 4, 5, 6, 7}};
      break;
    case PrimitiveType::kHexprism:
      mesh.vertices = {{0, 0, 0}, {1, 0.5, 0}, {0, 1, 0}, {0, 0, 1},
                       {1, 0, 1}, {1, 1, 1},   {0, 1, 1}};
      mesh.corners = {{0, 1, 1, 2, 3, 4, 5, 6}};
      break;
    case PrimitiveType::kPrism:
      mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
      mesh.corners = {{0, 1, 1, 2, 3, 4, 4, 5}};
      break;
    case PrimitiveType::kSlice:
      // A tetrahedron 0 1 2 3 with vertex 4 on the edge 1 - 3, a little outside.
      mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.55, 0, 0.55}};
      mesh.corners = {{0, 1, 1, 2, 3, 4, 4, 3}};
      break;
    case PrimitiveType::kPyramid:
      mesh.vertices = {{0.5, 0.5, 1}, {0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}};
      mesh.corners = {{0, 1, 1, 2, 0, 3, 3, 4}};
      break;
    case PrimitiveType::kTetrahedron:
      mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
      mesh.corners = {{0, 1, 1, 2, 0, 3, 3, 2}};
      break;
  }
  mesh.types = {type};
  mesh.quality = {static_cast<float>(ScaledJacobianOfCell(mesh.corners[0], mesh.vertices))};
  return mesh;
}

// The cells of `mesh` and of `other`, moved by `offset`, side by side without touching.
inline void Append(const AtMostHexaMesh& other, const Vec3d& offset, AtMostHexaMesh* mesh) {
  const auto first = static_cast<int32_t>(mesh->vertices.size());
  for (const Vec3d& v : other.vertices) mesh->vertices.push_back(v + offset);
  for (CellCorners corners : other.corners) {
    for (int32_t& corner : corners) corner += first;
    mesh->corners.push_back(corners);
  }
  mesh->types.insert(mesh->types.end(), other.types.begin(), other.types.end());
  mesh->quality.insert(mesh->quality.end(), other.quality.begin(), other.quality.end());
}

inline AtMostHexaMesh OneOfEach() {
  AtMostHexaMesh mesh;
  double x = 0;
  for (PrimitiveType type : kPrimitiveTypes) Append(OneCell(type), {x += 2.0, 0, 0}, &mesh);
  return mesh;
}

// n x n x n cubes of the unit block, some split into two prisms: those whose cell number is a
// multiple of `split_every`; 0 splits none.
inline AtMostHexaMesh Block(int n, int split_every) {
  AtMostHexaMesh mesh;
  const auto node = [n](int i, int j, int k) { return (k * (n + 1) + j) * (n + 1) + i; };
  for (int k = 0; k <= n; ++k) {
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i <= n; ++i)
        mesh.vertices.push_back(Vec3d{double(i), double(j), double(k)} / n);
    }
  }
  // Whole columns along z are split, so that their triangles meet triangles.
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const CellCorners c = {node(i, j, k),
                               node(i + 1, j, k),
                               node(i + 1, j + 1, k),
                               node(i, j + 1, k),
                               node(i, j, k + 1),
                               node(i + 1, j, k + 1),
                               node(i + 1, j + 1, k + 1),
                               node(i, j + 1, k + 1)};
        if (split_every != 0 && (j * n + i) % split_every == 0) {
          mesh.corners.push_back({c[0], c[1], c[1], c[2], c[4], c[5], c[5], c[6]});
          mesh.corners.push_back({c[0], c[2], c[2], c[3], c[4], c[6], c[6], c[7]});
        } else {
          mesh.corners.push_back(c);
        }
      }
    }
  }
  for (const CellCorners& corners : mesh.corners) {
    mesh.types.push_back(TypeOfCell(corners).value_or(PrimitiveType::kTetrahedron));
    mesh.quality.push_back(static_cast<float>(ScaledJacobianOfCell(corners, mesh.vertices)));
  }
  return mesh;
}

}  // namespace amhex::client
