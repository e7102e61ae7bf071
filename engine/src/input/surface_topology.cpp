#include "input/surface_topology.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace amhex {
namespace {

int32_t Start(const TriangleMesh& mesh, HalfEdgeId e) {
  return mesh.triangles[static_cast<size_t>(e / 3)][static_cast<size_t>(e % 3)];
}

HalfEdgeId NextInTriangle(HalfEdgeId e) { return e % 3 == 2 ? e - 2 : e + 1; }

int32_t EndOf(const TriangleMesh& mesh, HalfEdgeId e) { return Start(mesh, NextInTriangle(e)); }

// Union-find with path halving; the smaller root wins, so results do not depend on the order.
class CornerSets {
 public:
  explicit CornerSets(size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int32_t Root(int32_t i) {
    while (parent_[static_cast<size_t>(i)] != i) {
      int32_t& up = parent_[static_cast<size_t>(i)];
      up = parent_[static_cast<size_t>(up)];
      i = up;
    }
    return i;
  }
  void Join(int32_t i, int32_t j) {
    i = Root(i), j = Root(j);
    if (i != j) parent_[static_cast<size_t>(std::max(i, j))] = std::min(i, j);
  }

 private:
  std::vector<int32_t> parent_;
};

}  // namespace

EdgeAdjacency FindEdgeAdjacency(const TriangleMesh& mesh, const StopPoll& poll) {
  // Half-edges sorted by their smaller vertex (counting sort), then by the larger one.
  const auto half_edge_count = static_cast<HalfEdgeId>(3 * mesh.triangles.size());
  std::vector<int32_t> first(mesh.vertices.size() + 1, 0);
  const auto low = [&](HalfEdgeId e) { return std::min(Start(mesh, e), EndOf(mesh, e)); };
  const auto high = [&](HalfEdgeId e) { return std::max(Start(mesh, e), EndOf(mesh, e)); };
  for (HalfEdgeId e = 0; e < half_edge_count; ++e) {
    poll.At(e);
    ++first[static_cast<size_t>(low(e)) + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<HalfEdgeId> sorted(static_cast<size_t>(half_edge_count));
  std::vector<int32_t> next(first.begin(), first.end() - 1);
  for (HalfEdgeId e = 0; e < half_edge_count; ++e) {
    poll.At(e);
    sorted[static_cast<size_t>(next[static_cast<size_t>(low(e))]++)] = e;
  }

  EdgeAdjacency adjacency;
  adjacency.opposite.assign(static_cast<size_t>(half_edge_count), kOpenEdge);
  for (size_t v = 0; v + 1 < first.size(); ++v) {
    poll.At(static_cast<int64_t>(v));
    const auto begin = sorted.begin() + first[v], end = sorted.begin() + first[v + 1];
    std::sort(begin, end, [&](HalfEdgeId a, HalfEdgeId b) {
      return std::pair(high(a), a) < std::pair(high(b), b);
    });
    for (auto it = begin; it != end;) {
      auto same = it;
      while (same != end && high(*same) == high(*it)) ++same;
      ++adjacency.edge_count;
      const auto uses = same - it;
      if (uses == 1) {
        ++adjacency.open_edge_count;
      } else if (uses == 2) {
        adjacency.opposite[static_cast<size_t>(it[0])] = it[1];
        adjacency.opposite[static_cast<size_t>(it[1])] = it[0];
      } else {
        ++adjacency.non_manifold_edge_count;
        for (; it != same; ++it) adjacency.opposite[static_cast<size_t>(*it)] = kNonManifoldEdge;
      }
      it = same;
    }
  }
  return adjacency;
}

Components FindComponents(const EdgeAdjacency& adjacency, const StopPoll& poll) {
  const size_t triangle_count = adjacency.opposite.size() / 3;
  Components components;
  components.of_triangle.assign(triangle_count, -1);
  std::vector<int32_t> stack;
  for (size_t seed = 0; seed < triangle_count; ++seed) {
    if (components.of_triangle[seed] >= 0) continue;
    const int32_t id = components.count++;
    components.of_triangle[seed] = id;
    stack.push_back(static_cast<int32_t>(seed));
    while (!stack.empty()) {
      const int32_t t = stack.back();
      stack.pop_back();
      poll.At(t);
      for (int corner = 0; corner < 3; ++corner) {
        const HalfEdgeId other =
            adjacency.opposite[3 * static_cast<size_t>(t) + static_cast<size_t>(corner)];
        if (other < 0) continue;
        int32_t& label = components.of_triangle[static_cast<size_t>(other / 3)];
        if (label >= 0) continue;
        label = id;
        stack.push_back(other / 3);
      }
    }
  }
  return components;
}

OrientationResult MakeOrientationConsistent(const EdgeAdjacency& adjacency,
                                            const Components& components, TriangleMesh& mesh,
                                            const StopPoll& poll) {
  OrientationResult result;
  const size_t triangle_count = mesh.triangles.size();
  constexpr uint8_t kUnknown = 2;
  std::vector<uint8_t> turned(triangle_count, kUnknown);
  std::vector<int32_t> stack;
  for (size_t seed = 0; seed < triangle_count; ++seed) {
    if (turned[seed] != kUnknown) continue;
    turned[seed] = 0;
    stack.push_back(static_cast<int32_t>(seed));
    while (!stack.empty()) {
      const int32_t t = stack.back();
      stack.pop_back();
      poll.At(t);
      for (HalfEdgeId e = 3 * t; e < 3 * t + 3; ++e) {
        const HalfEdgeId other = adjacency.opposite[static_cast<size_t>(e)];
        if (other < 0) continue;
        // Neighbours agree when they run along their common edge in opposite directions.
        const bool disagree = Start(mesh, e) == Start(mesh, other);
        const auto wanted =
            static_cast<uint8_t>(turned[static_cast<size_t>(t)] ^ (disagree ? 1 : 0));
        uint8_t& state = turned[static_cast<size_t>(other / 3)];
        if (state == kUnknown) {
          state = wanted;
          stack.push_back(other / 3);
        } else if (state != wanted) {
          result.is_orientable = false;
          return result;
        }
      }
    }
  }
  poll.Now();
  std::vector<int64_t> size(static_cast<size_t>(components.count), 0);
  std::vector<int64_t> turned_in(static_cast<size_t>(components.count), 0);
  for (size_t t = 0; t < triangle_count; ++t) {
    const auto component = static_cast<size_t>(components.of_triangle[t]);
    ++size[component];
    turned_in[component] += turned[t];
  }
  result.was_inconsistent.resize(size.size());
  for (size_t component = 0; component < size.size(); ++component) {
    result.was_inconsistent[component] =
        turned_in[component] > 0 && turned_in[component] < size[component];
  }
  for (size_t t = 0; t < triangle_count; ++t) {
    poll.At(static_cast<int64_t>(t));
    const auto component = static_cast<size_t>(components.of_triangle[t]);
    const bool turn_fewer = 2 * turned_in[component] > size[component];
    if ((turned[t] != 0) == turn_fewer) continue;
    std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
    ++result.turned_count;
  }
  return result;
}

int64_t SplitFans(const EdgeAdjacency& adjacency, TriangleMesh& mesh, const StopPoll& poll) {
  const auto corner_count = static_cast<int32_t>(3 * mesh.triangles.size());
  CornerSets fans(static_cast<size_t>(corner_count));
  for (HalfEdgeId e = 0; e < corner_count; ++e) {
    poll.At(e);
    const HalfEdgeId other = adjacency.opposite[static_cast<size_t>(e)];
    if (other < e) continue;
    const HalfEdgeId after = NextInTriangle(e), other_after = NextInTriangle(other);
    if (Start(mesh, e) == Start(mesh, other)) {
      fans.Join(e, other), fans.Join(after, other_after);
    } else {
      fans.Join(e, other_after), fans.Join(after, other);
    }
  }
  // The first fan met keeps the vertex.
  std::vector<int32_t> owner(mesh.vertices.size(), -1);
  std::vector<int32_t> vertex_of_fan(static_cast<size_t>(corner_count), -1);
  int64_t added = 0;
  for (int32_t corner = 0; corner < corner_count; ++corner) {
    poll.At(corner);
    const int32_t fan = fans.Root(corner);
    int32_t& vertex =
        mesh.triangles[static_cast<size_t>(corner / 3)][static_cast<size_t>(corner % 3)];
    int32_t& assigned = vertex_of_fan[static_cast<size_t>(fan)];
    if (assigned < 0) {
      if (owner[static_cast<size_t>(vertex)] < 0) {
        owner[static_cast<size_t>(vertex)] = fan;
        assigned = vertex;
      } else {
        assigned = static_cast<int32_t>(mesh.vertices.size());
        const Vec3d position = mesh.vertices[static_cast<size_t>(vertex)];
        mesh.vertices.push_back(position);
        ++added;
      }
    }
    vertex = assigned;
  }
  return added;
}

int64_t DropLooseSheets(const EdgeAdjacency& adjacency, TriangleMesh& mesh) {
  const Components sheets = FindComponents(adjacency);
  std::vector<uint8_t> is_loose(static_cast<size_t>(sheets.count), 0);
  for (size_t e = 0; e < adjacency.opposite.size(); ++e) {
    if (adjacency.opposite[e] == kOpenEdge) {
      is_loose[static_cast<size_t>(sheets.of_triangle[e / 3])] = 1;
    }
  }
  TriangleMesh rest{mesh.vertices, {}};
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (is_loose[static_cast<size_t>(sheets.of_triangle[t])] == 0) {
      rest.triangles.push_back(mesh.triangles[t]);
    }
  }
  if (rest.triangles.empty() || !FindEdgeAdjacency(rest).IsClosedManifold()) return 0;
  mesh = std::move(rest);
  return std::accumulate(is_loose.begin(), is_loose.end(), int64_t{0});
}

std::vector<std::vector<int32_t>> FindOpenings(const EdgeAdjacency& adjacency,
                                               const TriangleMesh& mesh) {
  // A filling patch runs against the surface along the boundary: from each half-edge's end to
  // its start.
  std::vector<int32_t> next(mesh.vertices.size(), -1);
  for (size_t e = 0; e < adjacency.opposite.size(); ++e) {
    if (adjacency.opposite[e] != kOpenEdge) continue;
    const auto half_edge = static_cast<HalfEdgeId>(e);
    next[static_cast<size_t>(EndOf(mesh, half_edge))] = Start(mesh, half_edge);
  }
  std::vector<std::vector<int32_t>> loops;
  for (size_t v = 0; v < next.size(); ++v) {
    if (next[v] < 0) continue;
    std::vector<int32_t> loop;
    auto at = static_cast<int32_t>(v);
    while (at >= 0 && next[static_cast<size_t>(at)] >= 0) {
      loop.push_back(at);
      at = std::exchange(next[static_cast<size_t>(at)], -1);
    }
    if (loop.size() >= 3) loops.push_back(std::move(loop));
  }
  return loops;
}

int64_t GenusOf(const TriangleMesh& mesh, const EdgeAdjacency& adjacency,
                const Components& components) {
  std::vector<uint8_t> used(mesh.vertices.size(), 0);
  for (const auto& t : mesh.triangles) {
    for (const int32_t v : t) used[static_cast<size_t>(v)] = 1;
  }
  const int64_t vertex_count = std::accumulate(used.begin(), used.end(), int64_t{0});
  const int64_t euler =
      vertex_count - adjacency.edge_count + static_cast<int64_t>(mesh.triangles.size());
  return components.count - euler / 2;
}

int64_t DropUnusedVertices(TriangleMesh& mesh, const StopPoll& poll) {
  std::vector<int32_t> renamed(mesh.vertices.size(), -1);
  for (const auto& t : mesh.triangles) {
    for (const int32_t v : t) renamed[static_cast<size_t>(v)] = 0;
  }
  int32_t kept = 0;
  poll.Now();
  for (size_t v = 0; v < renamed.size(); ++v) {
    poll.At(static_cast<int64_t>(v));
    if (renamed[v] < 0) continue;
    renamed[v] = kept;
    mesh.vertices[static_cast<size_t>(kept++)] = mesh.vertices[v];
  }
  const auto dropped = static_cast<int64_t>(mesh.vertices.size()) - kept;
  mesh.vertices.resize(static_cast<size_t>(kept));
  poll.Now();
  for (auto& t : mesh.triangles) {
    for (int32_t& v : t) v = renamed[static_cast<size_t>(v)];
  }
  return dropped;
}

std::vector<double> ComponentVolumes(const TriangleMesh& mesh, const Components& components) {
  std::vector<double> volumes(static_cast<size_t>(components.count), 0);
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& corners = mesh.triangles[t];
    volumes[static_cast<size_t>(components.of_triangle[t])] +=
        Determinant(mesh.vertices[static_cast<size_t>(corners[0])],
                    mesh.vertices[static_cast<size_t>(corners[1])],
                    mesh.vertices[static_cast<size_t>(corners[2])]) /
        6;
  }
  return volumes;
}

}  // namespace amhex
