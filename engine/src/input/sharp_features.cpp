#include "input/sharp_features.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "input/sharp_question.h"

namespace amhex {
namespace {

// Edge lengths; see the header.
constexpr double kShortestChain = 2.0;
constexpr double kShortestFollowed = 3.0;
constexpr double kProbeAngleRatio = 0.7;

// The graph of candidate edges: vertices, and the edges that meet at each.
class FeatureGraph {
 public:
  FeatureGraph(std::vector<SharpEdge> edges, const Hull& hull)
      : hull_(hull), edges_(std::move(edges)), alive_(edges_.size(), 1) {
    std::vector<std::pair<int32_t, int32_t>> uses;
    for (size_t e = 0; e < edges_.size(); ++e) {
      uses.emplace_back(edges_[e].vertex_a, static_cast<int32_t>(e));
      uses.emplace_back(edges_[e].vertex_b, static_cast<int32_t>(e));
    }
    std::sort(uses.begin(), uses.end());
    uses_ = std::move(uses);
  }

  // Takes away loose ends until none is short, then what is too small as a whole.
  std::vector<SharpEdge> Prune() {
    while (RemoveShortChains()) {
    }
    RemoveSmallPieces();
    std::vector<SharpEdge> kept;
    for (size_t e = 0; e < edges_.size(); ++e) {
      if (alive_[e] != 0) kept.push_back(edges_[e]);
    }
    return kept;
  }

 private:
  double Length(size_t e) const {
    return Norm(hull_.vertices[static_cast<size_t>(edges_[e].vertex_a)] -
                hull_.vertices[static_cast<size_t>(edges_[e].vertex_b)]);
  }

  template <class Visit>
  void ForEdgesAt(int32_t vertex, const Visit& visit) const {
    auto it = std::lower_bound(uses_.begin(), uses_.end(), std::pair<int32_t, int32_t>(vertex, -1));
    for (; it != uses_.end() && it->first == vertex; ++it) {
      if (alive_[static_cast<size_t>(it->second)] != 0) visit(static_cast<size_t>(it->second));
    }
  }

  int DegreeOf(int32_t vertex) const {
    int degree = 0;
    ForEdgesAt(vertex, [&](size_t) { ++degree; });
    return degree;
  }

  int32_t OtherEnd(size_t e, int32_t vertex) const {
    return edges_[e].vertex_a == vertex ? edges_[e].vertex_b : edges_[e].vertex_a;
  }

  // Follows the chain from `e` away from `vertex` until it branches, ends or closes.
  int32_t Follow(size_t e, int32_t vertex, std::vector<size_t>& chain) const {
    const int32_t start = vertex;
    while (true) {
      chain.push_back(e);
      vertex = OtherEnd(e, vertex);
      if (vertex == start || DegreeOf(vertex) != 2) return vertex;
      size_t next = e;
      ForEdgesAt(vertex, [&](size_t other) {
        if (other != e) next = other;
      });
      if (next == e) return vertex;
      e = next;
    }
  }

  bool RemoveShortChains() {
    bool removed = false;
    for (size_t seed = 0; seed < edges_.size(); ++seed) {
      if (alive_[seed] == 0) continue;
      for (const int32_t tip : {edges_[seed].vertex_a, edges_[seed].vertex_b}) {
        if (alive_[seed] == 0 || DegreeOf(tip) != 1) continue;
        std::vector<size_t> chain;
        Follow(seed, tip, chain);
        double length = 0;
        for (const size_t e : chain) length += Length(e);
        if (length >= kShortestChain) continue;
        for (const size_t e : chain) alive_[e] = 0;
        removed = true;
      }
    }
    return removed;
  }

  void RemoveSmallPieces() {
    std::vector<uint8_t> seen(edges_.size(), 0);
    for (size_t seed = 0; seed < edges_.size(); ++seed) {
      if (alive_[seed] == 0 || seen[seed] != 0) continue;
      std::vector<size_t> piece = {seed};
      seen[seed] = 1;
      Box3d box;
      double length = 0;
      bool is_one_loop = true;
      for (size_t i = 0; i < piece.size(); ++i) {
        length += Length(piece[i]);
        for (const int32_t vertex : {edges_[piece[i]].vertex_a, edges_[piece[i]].vertex_b}) {
          box.Extend(hull_.vertices[static_cast<size_t>(vertex)]);
          is_one_loop = is_one_loop && DegreeOf(vertex) == 2;
          ForEdgesAt(vertex, [&](size_t other) {
            if (seen[other] != 0) return;
            seen[other] = 1;
            piece.push_back(other);
          });
        }
      }
      const double extent = is_one_loop ? length : box.Diagonal();
      if (extent >= kShortestChain) continue;
      for (const size_t e : piece) alive_[e] = 0;
    }
  }

  const Hull& hull_;
  std::vector<SharpEdge> edges_;
  std::vector<uint8_t> alive_;
  std::vector<std::pair<int32_t, int32_t>> uses_;  // (vertex, edge), sorted
};

std::vector<SharpEdge> CandidateEdges(double sharp_angle_degrees, const EdgeAdjacency& adjacency,
                                      const Hull& hull) {
  std::vector<SharpEdge> edges;
  if (sharp_angle_degrees >= 180) return edges;
  const double cosine = std::cos(sharp_angle_degrees * std::numbers::pi / 180);
  for (size_t e = 0; e < adjacency.opposite.size(); ++e) {
    const HalfEdgeId other = adjacency.opposite[e];
    if (other <= static_cast<HalfEdgeId>(e)) continue;
    const size_t left = e / 3, right = static_cast<size_t>(other / 3);
    if (Dot(hull.triangle_normals[left], hull.triangle_normals[right]) >= cosine) continue;
    const auto& corners = hull.triangles[left];
    edges.push_back({corners[e % 3], corners[(e + 1) % 3], static_cast<int32_t>(left),
                     static_cast<int32_t>(right)});
  }
  return edges;
}

// Unit vector in the plane of `triangle`, away from its edge a-b.
Vec3d AwayFromEdge(const Hull& hull, int32_t triangle, const Vec3d& a, const Vec3d& b,
                   const Vec3d& middle) {
  const Vec3d& normal = hull.triangle_normals[static_cast<size_t>(triangle)];
  Vec3d away = Normalized(Cross(normal, b - a));
  const auto& corners = hull.triangles[static_cast<size_t>(triangle)];
  Vec3d centre;
  for (const int32_t v : corners) centre += hull.vertices[static_cast<size_t>(v)] / 3.0;
  return Dot(away, centre - middle) < 0 ? -away : away;
}

SideOfEdge SideOf(const Hull& hull, int32_t triangle, const SharpEdge& edge, const Vec3d& middle) {
  const Vec3d& a = hull.vertices[static_cast<size_t>(edge.vertex_a)];
  const Vec3d& b = hull.vertices[static_cast<size_t>(edge.vertex_b)];
  SideOfEdge side{hull.triangle_normals[static_cast<size_t>(triangle)],
                  AwayFromEdge(hull, triangle, a, b, middle)};
  for (const int32_t v : hull.triangles[static_cast<size_t>(triangle)]) {
    side.height =
        std::max(side.height, Dot(hull.vertices[static_cast<size_t>(v)] - middle, side.away));
  }
  return side;
}

ProbedEdge Probed(const Hull& hull, const SharpEdge& edge) {
  const Vec3d middle = (hull.vertices[static_cast<size_t>(edge.vertex_a)] +
                        hull.vertices[static_cast<size_t>(edge.vertex_b)]) /
                       2.0;
  return {middle, SideOf(hull, edge.triangle_left, edge, middle),
          SideOf(hull, edge.triangle_right, edge, middle)};
}

void DropNoise(double sharp_angle_degrees, const Hull& hull, const HullAsker& asker,
               std::vector<SharpEdge>& edges) {
  if (edges.empty()) return;
  const double cosine = std::cos(kProbeAngleRatio * sharp_angle_degrees * std::numbers::pi / 180);
  std::vector<ProbedEdge> probed(edges.size());
  tbb::parallel_for(size_t{0}, edges.size(), [&](size_t i) { probed[i] = Probed(hull, edges[i]); });
  const std::vector<uint8_t> keep = asker.AskOrThrow(
      IsSharpToCells{{{probed.data(), static_cast<int64_t>(probed.size())}}, cosine});
  size_t kept = 0;
  for (size_t i = 0; i < edges.size(); ++i) {
    if (keep[i] != 0) edges[kept++] = edges[i];
  }
  edges.resize(kept);
}

void LabelPatches(const EdgeAdjacency& adjacency, Hull& hull) {
  std::vector<std::pair<int32_t, int32_t>> walls;
  for (const SharpEdge& edge : hull.sharp_edges) {
    walls.emplace_back(std::minmax(edge.triangle_left, edge.triangle_right));
  }
  std::sort(walls.begin(), walls.end());
  hull.patch.assign(hull.triangles.size(), -1);
  int32_t patch_count = 0;
  std::vector<int32_t> stack;
  for (size_t seed = 0; seed < hull.triangles.size(); ++seed) {
    if (hull.patch[seed] >= 0) continue;
    const int32_t id = patch_count++;
    hull.patch[seed] = id;
    stack.push_back(static_cast<int32_t>(seed));
    while (!stack.empty()) {
      const int32_t t = stack.back();
      stack.pop_back();
      for (int corner = 0; corner < 3; ++corner) {
        const HalfEdgeId opposite =
            adjacency.opposite[3 * static_cast<size_t>(t) + static_cast<size_t>(corner)];
        if (opposite < 0) continue;
        const int32_t other = opposite / 3;
        if (hull.patch[static_cast<size_t>(other)] >= 0) continue;
        const std::pair<int32_t, int32_t> wall = std::minmax(t, other);
        if (std::binary_search(walls.begin(), walls.end(), wall)) continue;
        hull.patch[static_cast<size_t>(other)] = id;
        stack.push_back(other);
      }
    }
  }
}

}  // namespace

std::vector<SharpEdge> FollowedEdges(const Hull& hull) {
  std::vector<int32_t> parent(hull.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto find = [&](int32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const SharpEdge& edge : hull.sharp_edges) {
    const int32_t a = find(edge.vertex_a), b = find(edge.vertex_b);
    if (a != b) parent[std::max(a, b)] = std::min(a, b);
  }
  std::vector<double> total(hull.vertices.size(), 0.0);
  for (const SharpEdge& edge : hull.sharp_edges) {
    total[find(edge.vertex_a)] += Norm(hull.vertices[edge.vertex_b] - hull.vertices[edge.vertex_a]);
  }
  std::vector<SharpEdge> followed;
  for (const SharpEdge& edge : hull.sharp_edges) {
    if (total[find(edge.vertex_a)] >= kShortestFollowed) followed.push_back(edge);
  }
  return followed;
}

void FindSharpFeatures(double sharp_angle_degrees, const EdgeAdjacency& adjacency,
                       const HullAsker& asker, Hull& hull) {
  std::vector<SharpEdge> candidates = CandidateEdges(sharp_angle_degrees, adjacency, hull);
  DropNoise(sharp_angle_degrees, hull, asker, candidates);
  FeatureGraph graph(std::move(candidates), hull);
  hull.sharp_edges = graph.Prune();
  hull.sharp_degree.assign(hull.vertices.size(), 0);
  for (const SharpEdge& edge : hull.sharp_edges) {
    for (const int32_t vertex : {edge.vertex_a, edge.vertex_b}) {
      uint8_t& degree = hull.sharp_degree[static_cast<size_t>(vertex)];
      if (degree < 255) ++degree;
    }
  }
  LabelPatches(adjacency, hull);
}

}  // namespace amhex
