#include "support/mesh_invariants.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

namespace amhex::testing_support {
namespace {

using Edge = std::pair<int32_t, int32_t>;

// The cube of volume_mesh.h: its faces counter-clockwise from outside, and its edges.
constexpr int kFaces[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                              {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
constexpr int kEdges[12][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                               {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};

const Vec3d& At(const std::vector<Vec3d>& vertices, int32_t id) {
  return vertices[static_cast<size_t>(id)];
}

int32_t CornerAt(const CellCorners& corners, int slot) {
  return corners[static_cast<size_t>(slot)];
}

std::vector<Edge> DirectedEdges(const Polygon& polygon) {
  std::vector<Edge> edges;
  for (size_t i = 0; i < polygon.size(); ++i) {
    edges.emplace_back(polygon[i], polygon[(i + 1) % polygon.size()]);
  }
  return edges;
}

// Every directed edge once and once in reverse; the first edge that is not, otherwise.
std::optional<Edge> FindOpenEdge(const std::vector<Polygon>& polygons) {
  std::map<Edge, int> uses;
  for (const Polygon& polygon : polygons) {
    for (const Edge& edge : DirectedEdges(polygon)) ++uses[edge];
  }
  for (const auto& [edge, count] : uses) {
    if (count != 1 || uses.count({edge.second, edge.first}) == 0) return edge;
  }
  return std::nullopt;
}

// Rotated to start at its least id: equal for equal oriented faces.
Polygon Canonical(Polygon polygon) {
  std::rotate(polygon.begin(), std::min_element(polygon.begin(), polygon.end()), polygon.end());
  return polygon;
}

Polygon Reversed(Polygon polygon) {
  std::reverse(polygon.begin(), polygon.end());
  return Canonical(std::move(polygon));
}

// Volume of the cone from the origin over the bilinear patch: the mean of both triangulations.
double ConeVolume(const Polygon& p, const std::vector<Vec3d>& vertices) {
  const auto cone = [&](size_t a, size_t b, size_t c) {
    return Determinant(At(vertices, p[a]), At(vertices, p[b]), At(vertices, p[c])) / 6;
  };
  if (p.size() == 3) return cone(0, 1, 2);
  return (cone(0, 1, 2) + cone(0, 2, 3) + cone(1, 2, 3) + cone(1, 3, 0)) / 2;
}

// Figure 2 by what can be counted: vertices, quads and triangles.
std::optional<PrimitiveType> CountedType(const CellCorners& corners) {
  const std::vector<Polygon> faces = CellPolygons(corners);
  const auto quads = std::count_if(faces.begin(), faces.end(),
                                   [](const Polygon& face) { return face.size() == 4; });
  const auto triangles = static_cast<std::ptrdiff_t>(faces.size()) - quads;
  const std::set<int32_t> distinct(corners.begin(), corners.end());
  const std::array<std::ptrdiff_t, 3> counts = {static_cast<std::ptrdiff_t>(distinct.size()), quads,
                                                triangles};
  const std::map<std::array<std::ptrdiff_t, 3>, PrimitiveType> known = {
      {{8, 6, 0}, PrimitiveType::kHexahedron}, {{7, 4, 2}, PrimitiveType::kHexprism},
      {{6, 3, 2}, PrimitiveType::kPrism},      {{5, 2, 2}, PrimitiveType::kSlice},
      {{5, 1, 4}, PrimitiveType::kPyramid},    {{4, 0, 4}, PrimitiveType::kTetrahedron}};
  const auto found = known.find(counts);
  if (found == known.end() || FindOpenEdge(faces)) return std::nullopt;
  return found->second;
}

std::string Place(const char* what, size_t index) { return what + std::to_string(index); }

// Law 1. Without it the others may not look.
std::string BrokenArrays(const AtMostHexaMesh& mesh) {
  if (mesh.types.size() != mesh.corners.size()) return "types and corners differ in length";
  if (mesh.quality.size() != mesh.corners.size()) return "quality and corners differ in length";
  const auto vertex_count = static_cast<int64_t>(mesh.vertices.size());
  for (size_t cell = 0; cell < mesh.corners.size(); ++cell) {
    for (const int32_t id : mesh.corners[cell]) {
      if (id < 0 || id >= vertex_count) return Place("a corner out of range in cell ", cell);
    }
  }
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Vec3d& p = mesh.vertices[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
      return Place("a position that is not finite at vertex ", i);
    }
  }
  return "";
}

// Law 2.
std::string BrokenCells(const AtMostHexaMesh& mesh) {
  for (size_t cell = 0; cell < mesh.corners.size(); ++cell) {
    const std::optional<PrimitiveType> type = CountedType(mesh.corners[cell]);
    if (!type) return Place("no cell of Figure 2: cell ", cell);
    if (*type != mesh.types[cell]) return Place("a wrong type at cell ", cell);
  }
  return "";
}

// Law 3.
std::string BrokenFaces(const AtMostHexaMesh& mesh) {
  std::map<Polygon, std::vector<Polygon>> seen;  // by sorted ids
  for (size_t cell = 0; cell < mesh.corners.size(); ++cell) {
    for (const Polygon& face : CellPolygons(mesh.corners[cell])) {
      Polygon key = face;
      std::sort(key.begin(), key.end());
      std::vector<Polygon>& sides = seen[key];
      sides.push_back(Canonical(face));
      if (sides.size() > 2) return Place("a face seen more than twice, last by cell ", cell);
      if (sides.size() == 2 && sides[0] != Reversed(sides[1])) {
        return Place("a shared face not seen from opposite sides, last by cell ", cell);
      }
    }
  }
  return "";
}

// Law 4.
std::string BrokenWalls(const std::vector<Polygon>& boundary) {
  std::set<Polygon> triangles;
  for (Polygon polygon : boundary) {
    std::sort(polygon.begin(), polygon.end());
    if (polygon.size() == 3) triangles.insert(polygon);
  }
  for (Polygon quad : boundary) {
    if (quad.size() != 4) continue;
    std::sort(quad.begin(), quad.end());
    for (size_t left_out = 0; left_out < 4; ++left_out) {
      Polygon triangle = quad;
      triangle.erase(triangle.begin() + static_cast<std::ptrdiff_t>(left_out));
      if (triangles.count(triangle) != 0) {
        return "a boundary quad on a boundary triangle at vertex " + std::to_string(triangle[0]);
      }
    }
  }
  return "";
}

// Law 6.
std::string BrokenSigns(const AtMostHexaMesh& mesh) {
  for (size_t cell = 0; cell < mesh.corners.size(); ++cell) {
    if (!(PolygonCellVolume(mesh.corners[cell], mesh.vertices) > 0)) {
      return Place("a volume that is not positive at cell ", cell);
    }
    if (!(LeastScaledJacobian(mesh.corners[cell], mesh.vertices) > 0)) {
      return Place("a scaled Jacobian that is not positive at cell ", cell);
    }
  }
  return "";
}

// Law 7.
std::string UnusedVertices(const AtMostHexaMesh& mesh) {
  std::vector<bool> is_used(mesh.vertices.size(), false);
  for (const CellCorners& corners : mesh.corners) {
    for (const int32_t id : corners) is_used[static_cast<size_t>(id)] = true;
  }
  const auto unused = std::find(is_used.begin(), is_used.end(), false);
  if (unused == is_used.end()) return "";
  return Place("a vertex of no cell: ", static_cast<size_t>(unused - is_used.begin()));
}

int64_t CountComponents(const std::vector<Polygon>& polygons, size_t vertex_count) {
  std::vector<int32_t> parent(vertex_count);
  std::iota(parent.begin(), parent.end(), 0);
  const auto root_of = [&](int32_t id) {
    while (parent[static_cast<size_t>(id)] != id) id = parent[static_cast<size_t>(id)];
    return id;
  };
  for (const Polygon& polygon : polygons) {
    for (const Edge& edge : DirectedEdges(polygon)) {
      const auto [low, high] = std::minmax({root_of(edge.first), root_of(edge.second)});
      parent[static_cast<size_t>(high)] = low;
    }
  }
  std::set<int32_t> roots;
  for (const Polygon& polygon : polygons) roots.insert(root_of(polygon[0]));
  return static_cast<int64_t>(roots.size());
}

}  // namespace

std::vector<Polygon> CellPolygons(const CellCorners& corners) {
  std::vector<Polygon> polygons;
  for (const auto& face : kFaces) {
    Polygon polygon;
    for (int i = 0; i < 4; ++i) {
      const int32_t id = CornerAt(corners, face[i]);
      if (id != CornerAt(corners, face[(i + 3) % 4])) polygon.push_back(id);
    }
    if (polygon.size() >= 3) polygons.push_back(polygon);
  }
  return polygons;
}

std::vector<Polygon> BoundaryPolygons(const AtMostHexaMesh& mesh) {
  std::map<Polygon, std::pair<int, Polygon>> seen;  // by sorted ids
  for (const CellCorners& corners : mesh.corners) {
    for (const Polygon& face : CellPolygons(corners)) {
      Polygon key = face;
      std::sort(key.begin(), key.end());
      auto& [count, polygon] = seen[key];
      ++count;
      polygon = face;
    }
  }
  std::vector<Polygon> boundary;
  for (const auto& [key, entry] : seen) {
    if (entry.first == 1) boundary.push_back(entry.second);
  }
  return boundary;
}

double PolygonCellVolume(const CellCorners& corners, const std::vector<Vec3d>& vertices) {
  double volume = 0;
  // Relative to a corner, so that a mesh far from the origin loses no digits.
  const Vec3d origin = At(vertices, corners[0]);
  std::vector<Vec3d> local;
  CellCorners local_corners{};
  std::map<int32_t, int32_t> local_ids;
  for (size_t slot = 0; slot < corners.size(); ++slot) {
    const auto [entry, is_new] =
        local_ids.try_emplace(corners[slot], static_cast<int32_t>(local.size()));
    if (is_new) local.push_back(At(vertices, corners[slot]) - origin);
    local_corners[slot] = entry->second;
  }
  for (const Polygon& face : CellPolygons(local_corners)) volume += ConeVolume(face, local);
  return volume;
}

double LeastScaledJacobian(const CellCorners& corners, const std::vector<Vec3d>& vertices) {
  std::map<int32_t, std::set<int32_t>> neighbours;
  for (const auto& edge : kEdges) {
    const int32_t a = CornerAt(corners, edge[0]), b = CornerAt(corners, edge[1]);
    if (a == b) continue;
    neighbours[a].insert(b);
    neighbours[b].insert(a);
  }
  double least = 1;
  for (const Polygon& face : CellPolygons(corners)) {
    for (size_t i = 0; i < face.size(); ++i) {
      const int32_t here = face[i];
      if (neighbours[here].size() != 3) continue;
      const int32_t before = face[(i + face.size() - 1) % face.size()];
      const int32_t after = face[(i + 1) % face.size()];
      for (const int32_t third : neighbours[here]) {
        if (third == before || third == after) continue;
        const auto edge = [&](int32_t to) {
          return Normalized(At(vertices, to) - At(vertices, here));
        };
        // Seen along the outward face: previous, next and the inner edge are right-handed.
        least = std::min(least, Determinant(edge(before), edge(after), edge(third)));
      }
    }
  }
  return least;
}

double TotalVolume(const AtMostHexaMesh& mesh) {
  double volume = 0;
  for (const CellCorners& corners : mesh.corners) {
    volume += PolygonCellVolume(corners, mesh.vertices);
  }
  return volume;
}

BoundaryMeasures MeasureBoundary(const AtMostHexaMesh& mesh) {
  const std::vector<Polygon> boundary = BoundaryPolygons(mesh);
  std::set<int32_t> vertices;
  std::set<Edge> edges;
  BoundaryMeasures measures;
  for (const Polygon& polygon : boundary) {
    vertices.insert(polygon.begin(), polygon.end());
    for (const Edge& edge : DirectedEdges(polygon)) {
      edges.insert({std::min(edge.first, edge.second), std::max(edge.first, edge.second)});
    }
    measures.enclosed_volume += ConeVolume(polygon, mesh.vertices);
  }
  measures.face_count = static_cast<int64_t>(boundary.size());
  measures.component_count = CountComponents(boundary, mesh.vertices.size());
  measures.euler_number = static_cast<int64_t>(vertices.size()) -
                          static_cast<int64_t>(edges.size()) + measures.face_count;
  return measures;
}

std::vector<std::string> BrokenLaws(const AtMostHexaMesh& mesh) {
  const std::string arrays = BrokenArrays(mesh);
  if (!arrays.empty()) return {arrays};

  std::vector<std::string> broken;
  const auto note = [&](const std::string& sentence) {
    if (!sentence.empty()) broken.push_back(sentence);
  };
  note(BrokenCells(mesh));
  note(BrokenFaces(mesh));
  const std::vector<Polygon> boundary = BoundaryPolygons(mesh);
  note(BrokenWalls(boundary));
  if (const std::optional<Edge> open = FindOpenEdge(boundary)) {
    note("a boundary edge not used once from each side: " + std::to_string(open->first) + "-" +
         std::to_string(open->second));
  }
  note(BrokenSigns(mesh));
  note(UnusedVertices(mesh));

  const double total = TotalVolume(mesh), enclosed = MeasureBoundary(mesh).enclosed_volume;
  constexpr double kRelativeTolerance = 1e-6;
  if (!(std::abs(total - enclosed) <= kRelativeTolerance * std::max(std::abs(total), 1e-30))) {
    note("the cells hold " + std::to_string(total) + " but the boundary encloses " +
         std::to_string(enclosed));
  }
  return broken;
}

}  // namespace amhex::testing_support
