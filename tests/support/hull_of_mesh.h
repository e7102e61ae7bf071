// The hull of a clean closed triangle mesh, built the plain way.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "amhex/input_hull.h"
#include "input/hull.h"
#include "input/hull_queries.h"

namespace amhex::testing_support {

// Normalised frame = the mesh's own units. Edges that bend by more than `sharp_degrees` are sharp.
inline Hull HullOfMesh(const TriangleMesh& mesh, double sharp_degrees = 35.0) {
  Hull hull;
  hull.vertices = mesh.vertices;
  hull.triangles = mesh.triangles;
  hull.input_points = mesh.vertices;
  hull.sharp_degree.assign(mesh.vertices.size(), 0);
  std::map<std::pair<int32_t, int32_t>, int32_t> left_of;  // directed edge -> triangle
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const Vec3d &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
    hull.triangle_normals.push_back(Normalized(Cross(q - p, r - p)));
    hull.volume += Determinant(p, q, r) / 6;
    const int32_t id = static_cast<int32_t>(t);
    left_of[{a, b}] = left_of[{b, c}] = left_of[{c, a}] = id;
  }
  for (const Vec3d& p : mesh.vertices) hull.box.Extend(p);
  hull.input_diagonal = hull.box.Diagonal();

  hull.patch.assign(mesh.triangles.size(), -1);
  const double smooth = std::cos(sharp_degrees * std::numbers::pi / 180);
  std::vector<std::vector<int32_t>> joined(mesh.triangles.size());
  for (const auto& [edge, left] : left_of) {
    const int32_t right = left_of.at({edge.second, edge.first});
    if (Dot(hull.triangle_normals[left], hull.triangle_normals[right]) >= smooth) {
      joined[left].push_back(right);
    } else if (edge.first < edge.second) {
      hull.sharp_edges.push_back({edge.first, edge.second, left, right});
      ++hull.sharp_degree[edge.first];
      ++hull.sharp_degree[edge.second];
    }
  }
  int32_t patch_count = 0;
  for (size_t t = 0; t < joined.size(); ++t) {
    if (hull.patch[t] >= 0) continue;
    std::vector<int32_t> front = {static_cast<int32_t>(t)};
    hull.patch[t] = patch_count;
    while (!front.empty()) {
      const int32_t at = front.back();
      front.pop_back();
      for (const int32_t next : joined[at]) {
        if (hull.patch[next] >= 0) continue;
        hull.patch[next] = patch_count;
        front.push_back(next);
      }
    }
    ++patch_count;
  }
  hull.component_count = 1;
  hull.queries = std::make_shared<HullQueries>(hull.vertices, hull.triangles);
  return hull;
}

}  // namespace amhex::testing_support
