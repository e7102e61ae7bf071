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

// A point just outside each component (all components looking outward), off its largest triangle.
std::vector<Vec3d> OutsideProbes(const TriangleMesh& mesh, const Components& components) {
  std::vector<Vec3d> probes(static_cast<size_t>(components.count));
  std::vector<double> largest(probes.size(), -1);
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& corners = mesh.triangles[t];
    const Vec3d& a = mesh.vertices[static_cast<size_t>(corners[0])];
    const Vec3d& b = mesh.vertices[static_cast<size_t>(corners[1])];
    const Vec3d& c = mesh.vertices[static_cast<size_t>(corners[2])];
    const Vec3d area_vector = DoubleAreaVector(a, b, c);
    const double area = Norm(area_vector);
    const auto component = static_cast<size_t>(components.of_triangle[t]);
    if (area <= largest[component]) continue;
    largest[component] = area;
    probes[component] =
        (a + b + c) / 3.0 + Normalized(area_vector) * (kProbeRatio * std::sqrt(area));
  }
  return probes;
}

std::vector<int64_t> WindingAt(const std::vector<Vec3d>& probes, const TriangleMesh& mesh) {
  const HullQueries queries(mesh.vertices, mesh.triangles);
  std::vector<int64_t> windings;
  for (const Vec3d& probe : probes) windings.push_back(std::llround(queries.WindingNumber(probe)));
  return windings;
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
  const std::vector<Vec3d> probes = OutsideProbes(mesh, components);
  const std::vector<int64_t> depth = WindingAt(probes, mesh);

  double outermost_balance = 0;
  for (size_t c = 0; c < count; ++c) {
    if (depth[c] <= 0 && was_inconsistent[c] == 0) outermost_balance += volumes[c];
  }
  const bool all_inverted = outermost_balance < 0;
  std::vector<uint8_t> faces_inward(count, 0);
  for (size_t c = 0; c < count; ++c) {
    if (depth[c] <= 0) continue;
    faces_inward[c] =
        was_inconsistent[c] != 0 ? depth[c] % 2 == 1 : (looked_inward[c] != 0) != all_inverted;
  }
  TurnComponents(faces_inward, components, mesh);
  // A component bounds the solid if exactly one of its sides is solid.
  const std::vector<int64_t> outside = WindingAt(probes, mesh);
  for (size_t c = 0; c < count; ++c) {
    const int64_t inside = outside[c] + (faces_inward[c] != 0 ? -1 : 1);
    const bool bounds = (outside[c] >= 1) != (inside >= 1);
    if (faces_inward[c] != looked_inward[c]) ++decision.turned_components;
    keep.resize(count);
    keep[c] = bounds;
  }
  decision.dropped_components += KeepComponents(keep, mesh, components);
  return decision;
}

}  // namespace amhex
