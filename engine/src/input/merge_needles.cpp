#include "input/merge_needles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "input/collapse_short_edges.h"
#include "input/surface_topology.h"
#include "input/triangle_math.h"

namespace amhex {
namespace {

// In edge lengths. Ends nearer than a twentieth are joined: a vertex placed on the hull is told
// from one beside it by no less (closure's kSliverOnHullDistance is a fiftieth).
constexpr double kLeastLength = 2.0;
constexpr double kJoinedWidth = 0.05;
// Hierarchies of triangles answer for a place by those whose boxes hold it. Of a surface of
// triangles as long as wide these are some ten; so many needles per squared edge length, each
// counted where it runs, cost no more than the cells do.
constexpr double kMostCrossings = 8.0;
// A joined end has lost its edges for the round; each round joins a third of the ends or more.
constexpr int kMostRounds = 20;
// Fewer are looked at in no time.
constexpr double kFewCrossings = 1e4;

class NeedleFinder {
 public:
  NeedleFinder(double edge_length, double sharp_angle_degrees, const TriangleMesh& mesh)
      : edge_length_(edge_length),
        sharp_cosine_(std::cos(sharp_angle_degrees * std::numbers::pi / 180)),
        mesh_(mesh) {}

  bool AreMany(const StopPoll& poll) const {
    double crossings = 0, area = 0;
    for (size_t t = 0; t < mesh_.triangles.size(); ++t) {
      poll.At(static_cast<int64_t>(t));
      area += Norm(NormalOf(t)) / 2;
      if (IsNeedle(t)) crossings += Longest(t) / edge_length_;
    }
    area /= edge_length_ * edge_length_;
    return crossings > kFewCrossings && crossings > kMostCrossings * area;
  }

  // The short edges of needles, but for those that part two sharp edges; `rank` as
  // collapse_short_edges.h wants it.
  std::vector<MeshEdge> ShortEdges(const StopPoll& poll, std::vector<uint8_t>& rank) const {
    const EdgeAdjacency adjacency = FindEdgeAdjacency(mesh_, poll);
    std::vector<uint8_t> sharp_at(mesh_.vertices.size(), 0);
    std::vector<uint8_t> is_sharp(adjacency.opposite.size(), 0);
    for (size_t e = 0; e < adjacency.opposite.size(); ++e) {
      is_sharp[e] = IsSharp(e, adjacency.opposite[e]) ? 1 : 0;
      if (is_sharp[e] == 0) continue;
      uint8_t& count = sharp_at[static_cast<size_t>(Begin(e))];
      count = static_cast<uint8_t>(std::min(count + 1, 3));
    }
    rank.assign(mesh_.vertices.size(), 1);
    for (size_t v = 0; v < rank.size(); ++v) {
      if (sharp_at[v] > 0) rank[v] = sharp_at[v] == 2 ? 2 : 3;
    }
    std::vector<MeshEdge> edges;
    for (size_t t = 0; t < mesh_.triangles.size(); ++t) {
      poll.At(static_cast<int64_t>(t));
      if (!IsNeedle(t)) continue;
      for (size_t e = 3 * t; e < 3 * t + 3; ++e) {
        if (LengthOf(e) >= kJoinedWidth * edge_length_) continue;
        const int32_t u = Begin(e), v = End(e);
        const bool parts = is_sharp[e] == 0 && rank[static_cast<size_t>(u)] > 1 &&
                           rank[static_cast<size_t>(v)] > 1;
        if (!parts) edges.push_back({std::min(u, v), std::max(u, v)});
      }
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    return edges;
  }

 private:
  int32_t Begin(size_t edge) const { return mesh_.triangles[edge / 3][edge % 3]; }
  int32_t End(size_t edge) const { return mesh_.triangles[edge / 3][(edge + 1) % 3]; }
  const Vec3d& At(int32_t v) const { return mesh_.vertices[static_cast<size_t>(v)]; }
  double LengthOf(size_t edge) const { return Norm(At(End(edge)) - At(Begin(edge))); }
  double Longest(size_t t) const {
    return std::max({LengthOf(3 * t), LengthOf(3 * t + 1), LengthOf(3 * t + 2)});
  }
  Vec3d NormalOf(size_t t) const {
    const auto& [a, b, c] = mesh_.triangles[t];
    return DoubleAreaVector(At(a), At(b), At(c));
  }
  bool IsNeedle(size_t t) const {
    const double longest = Longest(t);
    return longest > kLeastLength * edge_length_ &&
           Norm(NormalOf(t)) < kJoinedWidth * edge_length_ * longest;
  }
  bool IsSharp(size_t edge, HalfEdgeId opposite) const {
    if (opposite < 0) return true;
    return Dot(Normalized(NormalOf(edge / 3)),
               Normalized(NormalOf(static_cast<size_t>(opposite) / 3))) < sharp_cosine_;
  }

  const double edge_length_, sharp_cosine_;
  const TriangleMesh& mesh_;
};

}  // namespace

int64_t MergeNeedles(double edge_length, double sharp_angle_degrees, TriangleMesh& mesh,
                     const StopPoll& poll) {
  int64_t joined = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    const NeedleFinder finder(edge_length, sharp_angle_degrees, mesh);
    if (!finder.AreMany(poll)) break;
    std::vector<uint8_t> rank;
    const std::vector<MeshEdge> edges = finder.ShortEdges(poll, rank);
    const int64_t count = CollapseShortEdges(kJoinedWidth * edge_length, edges, mesh, rank, poll);
    joined += count;
    if (count == 0) break;
  }
  return joined;
}

}  // namespace amhex
