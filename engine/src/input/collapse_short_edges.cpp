#include "input/collapse_short_edges.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "input/triangle_math.h"

namespace amhex {
namespace {

// Triangles may turn by this much when a corner moves.
constexpr double kLeastCosine = 0.5;

class Collapser {
 public:
  Collapser(double shortest, TriangleMesh& mesh, std::vector<uint8_t>& rank)
      : shortest_(shortest), mesh_(mesh), rank_(rank), around_(mesh.vertices.size()) {
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (const int32_t v : mesh.triangles[t]) {
        around_[static_cast<size_t>(v)].push_back(static_cast<int32_t>(t));
      }
    }
  }

  int64_t Run(const std::vector<MeshEdge>& candidates, const StopPoll& poll) {
    std::vector<std::tuple<double, int32_t, int32_t>> edges;
    for (const auto& [u, v] : candidates) {
      const double length = Norm(At(u) - At(v));
      if (length < shortest_) edges.emplace_back(length, u, v);
    }
    std::sort(edges.begin(), edges.end());
    int64_t collapses = 0, seen = 0;
    for (const auto& [length, u, v] : edges) {
      poll.At(seen++);
      collapses += Collapse(u, v) ? 1 : 0;
    }
    return collapses;
  }

  void Compact() {
    size_t kept = 0;
    for (const auto& t : mesh_.triangles) {
      if (t[0] >= 0) mesh_.triangles[kept++] = t;
    }
    mesh_.triangles.resize(kept);
    std::vector<int32_t> renamed(mesh_.vertices.size(), -1);
    size_t vertex_count = 0;
    for (size_t v = 0; v < renamed.size(); ++v) {
      if (around_[v].empty()) continue;
      renamed[v] = static_cast<int32_t>(vertex_count);
      rank_[vertex_count] = rank_[v];
      mesh_.vertices[vertex_count++] = mesh_.vertices[v];
    }
    mesh_.vertices.resize(vertex_count), rank_.resize(vertex_count);
    for (auto& t : mesh_.triangles) {
      for (int32_t& v : t) v = renamed[static_cast<size_t>(v)];
    }
  }

 private:
  const Vec3d& At(int32_t v) const { return mesh_.vertices[static_cast<size_t>(v)]; }

  std::vector<int32_t> NeighboursOf(int32_t v) const {
    std::vector<int32_t> neighbours;
    for (const int32_t t : around_[static_cast<size_t>(v)]) {
      for (const int32_t w : mesh_.triangles[static_cast<size_t>(t)]) {
        if (w != v) neighbours.push_back(w);
      }
    }
    std::sort(neighbours.begin(), neighbours.end());
    neighbours.erase(std::unique(neighbours.begin(), neighbours.end()), neighbours.end());
    return neighbours;
  }

  // Exactly the two apices are neighbours of both ends, and enough surface stays.
  bool KeepsTopology(int32_t u, int32_t v) const {
    const std::vector<int32_t> of_u = NeighboursOf(u), of_v = NeighboursOf(v);
    if (!std::binary_search(of_u.begin(), of_u.end(), v)) return false;
    std::vector<int32_t> both;
    std::set_intersection(of_u.begin(), of_u.end(), of_v.begin(), of_v.end(),
                          std::back_inserter(both));
    if (both.size() != 2) return false;
    // A vertex of a closed surface has as many neighbours as triangles.
    return around_[static_cast<size_t>(both[0])].size() > 3 &&
           around_[static_cast<size_t>(both[1])].size() > 3;
  }

  bool TurnsTriangleOver(int32_t moved, int32_t other, const Vec3d& to) const {
    for (const int32_t t : around_[static_cast<size_t>(moved)]) {
      std::array<Vec3d, 3> corner;
      bool vanishes = false;
      const auto& triangle = mesh_.triangles[static_cast<size_t>(t)];
      for (size_t i = 0; i < 3; ++i) {
        vanishes = vanishes || triangle[i] == other;
        corner[i] = At(triangle[i]);
      }
      if (vanishes || IsDegenerate(corner[0], corner[1], corner[2])) continue;
      const Vec3d before = Normalized(DoubleAreaVector(corner[0], corner[1], corner[2]));
      for (size_t i = 0; i < 3; ++i) {
        if (triangle[i] == moved) corner[i] = to;
      }
      const Vec3d after = Normalized(DoubleAreaVector(corner[0], corner[1], corner[2]));
      if (Dot(before, after) < kLeastCosine) return true;
    }
    return false;
  }

  // v goes into u.
  bool Collapse(int32_t u, int32_t v) {
    if (around_[static_cast<size_t>(u)].empty() || around_[static_cast<size_t>(v)].empty()) {
      return false;
    }
    if (Norm(At(u) - At(v)) >= shortest_ || !KeepsTopology(u, v)) return false;
    uint8_t& rank_u = rank_[static_cast<size_t>(u)];
    const uint8_t rank_v = rank_[static_cast<size_t>(v)];
    const Vec3d to = rank_u > rank_v ? At(u) : rank_u < rank_v ? At(v) : (At(u) + At(v)) / 2.0;
    if (TurnsTriangleOver(u, v, to) || TurnsTriangleOver(v, u, to)) return false;
    rank_u = std::max(rank_u, rank_v);
    mesh_.vertices[static_cast<size_t>(u)] = to;
    auto& around_u = around_[static_cast<size_t>(u)];
    for (const int32_t t : around_[static_cast<size_t>(v)]) {
      auto& triangle = mesh_.triangles[static_cast<size_t>(t)];
      if (std::find(triangle.begin(), triangle.end(), u) != triangle.end()) {
        for (const int32_t w : triangle) {
          if (w != v) std::erase(around_[static_cast<size_t>(w)], t);
        }
        triangle = {-1, -1, -1};
      } else {
        std::replace(triangle.begin(), triangle.end(), v, u);
        around_u.push_back(t);
      }
    }
    around_[static_cast<size_t>(v)].clear();
    return true;
  }

  const double shortest_;
  TriangleMesh& mesh_;
  std::vector<uint8_t>& rank_;
  std::vector<std::vector<int32_t>> around_;  // triangles of each vertex
};

}  // namespace

int64_t CollapseShortEdges(double shortest, TriangleMesh& mesh, std::vector<uint8_t>& rank) {
  std::vector<MeshEdge> edges;
  for (const auto& t : mesh.triangles) {
    for (size_t i = 0; i < 3; ++i) {
      const int32_t u = t[i], v = t[(i + 1) % 3];
      if (u < v) edges.push_back({u, v});
    }
  }
  return CollapseShortEdges(shortest, edges, mesh, rank);
}

int64_t CollapseShortEdges(double shortest, const std::vector<MeshEdge>& edges, TriangleMesh& mesh,
                           std::vector<uint8_t>& rank, const StopPoll& poll) {
  Collapser collapser(shortest, mesh, rank);
  const int64_t collapses = collapser.Run(edges, poll);
  collapser.Compact();
  return collapses;
}

}  // namespace amhex
