// What a test asks of a triangle surface, computed the plain way.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <utility>

#include "amhex/input_hull.h"
#include "amhex/vec3.h"

namespace amhex::testing_support {

inline const Vec3d& Corner(const TriangleMesh& mesh, const std::array<int32_t, 3>& triangle,
                           int corner) {
  return mesh.vertices[static_cast<size_t>(triangle[static_cast<size_t>(corner)])];
}

// Volume enclosed by a closed outward oriented surface; negative when it is inside out.
inline double EnclosedVolume(const TriangleMesh& mesh) {
  double volume = 0;
  for (const auto& t : mesh.triangles) {
    volume += Determinant(Corner(mesh, t, 0), Corner(mesh, t, 1), Corner(mesh, t, 2)) / 6;
  }
  return volume;
}

inline double SurfaceArea(const TriangleMesh& mesh) {
  double area = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3d& a = Corner(mesh, t, 0);
    area += Norm(Cross(Corner(mesh, t, 1) - a, Corner(mesh, t, 2) - a)) / 2;
  }
  return area;
}

// True if every directed edge occurs exactly once and its reverse too: closed, two-manifold along
// edges, consistently oriented.
inline bool IsClosedAndOriented(const TriangleMesh& mesh) {
  std::map<std::pair<int32_t, int32_t>, int> uses;
  for (const auto& t : mesh.triangles) {
    for (size_t i = 0; i < 3; ++i) ++uses[{t[i], t[(i + 1) % 3]}];
  }
  for (const auto& [edge, count] : uses) {
    if (count != 1 || uses.count({edge.second, edge.first}) == 0) return false;
  }
  return true;
}

// V - E + F over the used vertices; 2 - 2 genus for one closed component.
inline int64_t EulerNumber(const TriangleMesh& mesh) {
  std::set<int32_t> vertices;
  std::set<std::pair<int32_t, int32_t>> edges;
  for (const auto& t : mesh.triangles) {
    for (size_t i = 0; i < 3; ++i) {
      vertices.insert(t[i]);
      edges.insert(std::minmax(t[i], t[(i + 1) % 3]));
    }
  }
  return static_cast<int64_t>(vertices.size()) - static_cast<int64_t>(edges.size()) +
         static_cast<int64_t>(mesh.triangles.size());
}

}  // namespace amhex::testing_support
