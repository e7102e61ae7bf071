#include "input/orient_components.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "input/hull_queries.h"
#include "input/triangle_math.h"

namespace amhex {
namespace {

// Of the total volume; less is a film, not a part.
constexpr double kSmallestVolumeRatio = 1e-9;
// Places per component at which its surroundings are looked at.
constexpr size_t kProbesPerComponent = 16;
// How far from a component's surface its surroundings are looked at, in square roots of its
// largest triangle's area.
constexpr double kProbeRatio = 1e-4;

void TurnComponents(const std::vector<uint8_t>& turn, const Components& components,
                    TriangleMesh& mesh) {
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (turn[static_cast<size_t>(components.of_triangle[t])] == 0) continue;
    std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
  }
}

// Keeps the components marked; renumbers them.
int64_t KeepComponents(const std::vector<uint8_t>& keep, TriangleMesh& mesh,
                       Components& components) {
  std::vector<int32_t> renamed(keep.size(), -1);
  int32_t kept_components = 0;
  for (size_t c = 0; c < keep.size(); ++c) {
    if (keep[c] != 0) renamed[c] = kept_components++;
  }
  size_t kept = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const int32_t name = renamed[static_cast<size_t>(components.of_triangle[t])];
    if (name < 0) continue;
    mesh.triangles[kept] = mesh.triangles[t];
    components.of_triangle[kept++] = name;
  }
  mesh.triangles.resize(kept);
  components.of_triangle.resize(kept);
  components.count = kept_components;
  return static_cast<int64_t>(keep.size()) - kept_components;
}

double AreaOf(const TriangleMesh& mesh, size_t triangle) {
  const auto& t = mesh.triangles[triangle];
  return Norm(DoubleAreaVector(mesh.vertices[static_cast<size_t>(t[0])],
                               mesh.vertices[static_cast<size_t>(t[1])],
                               mesh.vertices[static_cast<size_t>(t[2])])) /
         2;
}

// Points just outside each component (all components looking outward), off triangles evenly spread
// over its list; collapsed triangles have none.
std::vector<std::vector<Vec3d>> OutsideProbes(const TriangleMesh& mesh,
                                              const Components& components) {
  std::vector<std::vector<size_t>> members(static_cast<size_t>(components.count));
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    members[static_cast<size_t>(components.of_triangle[t])].push_back(t);
  }
  std::vector<std::vector<Vec3d>> probes(members.size());
  for (size_t c = 0; c < members.size(); ++c) {
    const size_t step = std::max<size_t>(1, members[c].size() / kProbesPerComponent);
    for (size_t i = 0; i < members[c].size(); i += step) {
      const auto& corners = mesh.triangles[members[c][i]];
      const Vec3d& p = mesh.vertices[static_cast<size_t>(corners[0])];
      const Vec3d& q = mesh.vertices[static_cast<size_t>(corners[1])];
      const Vec3d& r = mesh.vertices[static_cast<size_t>(corners[2])];
      if (IsDegenerate(p, q, r)) continue;
      const Vec3d area_vector = DoubleAreaVector(p, q, r);
      probes[c].push_back((p + q + r) / 3.0 +
                          Normalized(area_vector) * (kProbeRatio * std::sqrt(Norm(area_vector))));
    }
  }
  return probes;
}

// The winding number around each component; `differs` is set if it is not the same all around one.
std::vector<int64_t> WindingAt(const std::vector<std::vector<Vec3d>>& probes,
                               const TriangleMesh& mesh, bool& differs) {
  const HullQueries queries(mesh.vertices, mesh.triangles);
  std::vector<int64_t> windings;
  for (const std::vector<Vec3d>& around : probes) {
    int64_t winding = 0;
    for (size_t i = 0; i < around.size(); ++i) {
      const int64_t here = std::llround(queries.WindingNumber(around[i]));
      if (i == 0) winding = here;
      differs = differs || here != winding;
    }
    windings.push_back(winding);
  }
  return windings;
}

// What is known of each component.
struct GivenComponents {
  const std::vector<double>& volumes;
  const std::vector<uint8_t>& looked_inward;
  const std::vector<uint8_t>& was_inconsistent;
};

// Those that bound a cavity, at the depths at which all of them lie once they look outward.
std::vector<uint8_t> FacesInward(const GivenComponents& given, const std::vector<int64_t>& depth) {
  const size_t count = depth.size();
  double outermost_balance = 0;
  for (size_t c = 0; c < count; ++c) {
    if (depth[c] > 0 || given.was_inconsistent[c] != 0) continue;
    const double volume = std::abs(given.volumes[c]);
    outermost_balance += given.looked_inward[c] != 0 ? -volume : volume;
  }
  const bool all_inverted = outermost_balance < 0;
  std::vector<uint8_t> faces_inward(count, 0);
  for (size_t c = 0; c < count; ++c) {
    if (depth[c] <= 0) continue;
    faces_inward[c] = given.was_inconsistent[c] != 0
                          ? depth[c] % 2 == 1
                          : (given.looked_inward[c] != 0) != all_inverted;
  }
  return faces_inward;
}

// Of each component: whether no edge of it is open or has more than two triangles.
std::vector<uint8_t> ClosedComponents(const EdgeAdjacency& adjacency,
                                      const Components& components) {
  std::vector<uint8_t> is_closed(static_cast<size_t>(components.count), 1);
  for (size_t e = 0; e < adjacency.opposite.size(); ++e) {
    if (adjacency.opposite[e] < 0)
      is_closed[static_cast<size_t>(components.of_triangle[e / 3])] = 0;
  }
  return is_closed;
}

}  // namespace

ComponentDecision OrientComponents(const OrientationResult& orientation, TriangleMesh& mesh,
                                   Components& components) {
  ComponentDecision decision;
  std::vector<double> volumes = ComponentVolumes(mesh, components);
  std::vector<uint8_t> was_inconsistent = orientation.was_inconsistent;
  double total = 0;
  for (const double volume : volumes) total += std::abs(volume);
  std::vector<uint8_t> keep(volumes.size());
  for (size_t c = 0; c < keep.size(); ++c) {
    keep[c] = std::abs(volumes[c]) > kSmallestVolumeRatio * total;
  }
  double area = 0, flat_area = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const bool is_flat = keep[static_cast<size_t>(components.of_triangle[t])] == 0;
    area += AreaOf(mesh, t);
    flat_area += is_flat ? AreaOf(mesh, t) : 0;
  }
  decision.dropped_flat_area_ratio = area > 0 ? flat_area / area : 0;
  decision.dropped_components += KeepComponents(keep, mesh, components);
  const auto compress = [&](auto& values) {
    size_t kept = 0;
    for (size_t c = 0; c < keep.size(); ++c) {
      if (keep[c] != 0) values[kept++] = values[c];
    }
    values.resize(kept);
  };
  compress(volumes), compress(was_inconsistent);
  const size_t count = volumes.size();

  // All outward: the winding number outside a component then is its nesting depth.
  std::vector<uint8_t> looked_inward(count);
  for (size_t c = 0; c < count; ++c) looked_inward[c] = volumes[c] < 0;
  TurnComponents(looked_inward, components, mesh);
  if (count <= 1) {
    decision.turned_components = count == 1 && looked_inward[0] != 0 ? 1 : 0;
    return decision;
  }
  const std::vector<std::vector<Vec3d>> probes = OutsideProbes(mesh, components);
  const std::vector<int64_t> depth = WindingAt(probes, mesh, decision.components_cut);

  const std::vector<uint8_t> faces_inward =
      FacesInward({volumes, looked_inward, was_inconsistent}, depth);
  TurnComponents(faces_inward, components, mesh);
  // A component bounds the solid if exactly one of its sides is solid.
  const std::vector<int64_t> outside = WindingAt(probes, mesh, decision.components_cut);
  if (decision.components_cut) return decision;
  keep.resize(count);
  for (size_t c = 0; c < count; ++c) {
    const int64_t inside = outside[c] + (faces_inward[c] != 0 ? -1 : 1);
    const bool bounds = (outside[c] >= 1) != (inside >= 1);
    if (faces_inward[c] != looked_inward[c]) ++decision.turned_components;
    keep[c] = bounds;
  }
  decision.dropped_components += KeepComponents(keep, mesh, components);
  return decision;
}

int64_t TurnClosedComponents(const OrientationResult& orientation, const EdgeAdjacency& adjacency,
                             const Components& components, TriangleMesh& mesh) {
  const std::vector<uint8_t> is_closed = ClosedComponents(adjacency, components);
  TriangleMesh closed = mesh;
  Components closed_components = components;
  KeepComponents(is_closed, closed, closed_components);
  if (closed_components.count == 0) return 0;
  const std::vector<double> volumes = ComponentVolumes(closed, closed_components);
  std::vector<uint8_t> looked_inward, was_inconsistent;
  for (const double volume : volumes) looked_inward.push_back(volume < 0);
  for (size_t c = 0; c < is_closed.size(); ++c) {
    if (is_closed[c] != 0) was_inconsistent.push_back(orientation.was_inconsistent[c]);
  }
  TurnComponents(looked_inward, closed_components, closed);
  bool differs = false;
  const std::vector<int64_t> depth =
      WindingAt(OutsideProbes(closed, closed_components), closed, differs);
  const std::vector<uint8_t> faces_inward =
      FacesInward({volumes, looked_inward, was_inconsistent}, depth);
  TurnComponents(faces_inward, closed_components, closed);
  size_t next = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (is_closed[static_cast<size_t>(components.of_triangle[t])] == 0) continue;
    mesh.triangles[t] = closed.triangles[next++];
  }
  int64_t turned = 0;
  for (size_t c = 0; c < volumes.size(); ++c) turned += faces_inward[c] != looked_inward[c];
  return turned;
}

}  // namespace amhex
