#include "input/repeated_components.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>
#include <vector>

#include "base/sort_polling.h"

namespace amhex {
namespace {

using Place = std::array<double, 3>;
using TrianglePlaces = std::array<Place, 3>;  // in ascending order

Place PlaceOf(const Vec3d& p) { return {p.x + 0.0, p.y + 0.0, p.z + 0.0}; }  // -0 and 0 are one

TrianglePlaces PlacesOf(const TriangleMesh& mesh, size_t triangle) {
  TrianglePlaces places;
  for (size_t k = 0; k < 3; ++k) {
    places[k] = PlaceOf(mesh.vertices[static_cast<size_t>(mesh.triangles[triangle][k])]);
  }
  std::sort(places.begin(), places.end());
  return places;
}

struct Extent {
  size_t triangles = 0;
  Place low, high;
  friend auto operator<=>(const Extent&, const Extent&) = default;
};

std::vector<Extent> ExtentsOf(const TriangleMesh& mesh, const Components& components,
                              const StopPoll& poll) {
  const auto count = static_cast<size_t>(components.count);
  std::vector<Box3d> boxes(count);
  std::vector<Extent> extents(count);
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    poll.At(static_cast<int64_t>(t));
    const auto c = static_cast<size_t>(components.of_triangle[t]);
    ++extents[c].triangles;
    for (const int32_t v : mesh.triangles[t]) {
      boxes[c].Extend(mesh.vertices[static_cast<size_t>(v)]);
    }
  }
  for (size_t c = 0; c < count; ++c) {
    extents[c].low = PlaceOf(boxes[c].low), extents[c].high = PlaceOf(boxes[c].high);
  }
  return extents;
}

// The places of the triangles of those components that are `wanted`, in ascending order.
std::vector<std::vector<TrianglePlaces>> PlacesOfComponents(const TriangleMesh& mesh,
                                                            const Components& components,
                                                            const std::vector<uint8_t>& wanted,
                                                            const StopPoll& poll) {
  std::vector<std::vector<TrianglePlaces>> places(wanted.size());
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    poll.At(static_cast<int64_t>(t));
    const auto c = static_cast<size_t>(components.of_triangle[t]);
    if (wanted[c] != 0) places[c].push_back(PlacesOf(mesh, t));
  }
  for (auto& list : places) SortPolling(list.begin(), list.end(), poll);
  return places;
}

}  // namespace

int64_t DropRepeatedComponents(const Components& components, TriangleMesh& mesh,
                               const StopPoll& poll) {
  if (components.count <= 1) return 0;
  const std::vector<Extent> extents = ExtentsOf(mesh, components, poll);
  std::map<Extent, std::vector<size_t>> alike;
  for (size_t c = 0; c < extents.size(); ++c) alike[extents[c]].push_back(c);
  std::erase_if(alike, [](const auto& group) { return group.second.size() == 1; });
  if (alike.empty()) return 0;
  std::vector<uint8_t> wanted(extents.size(), 0), repeated(extents.size(), 0);
  for (const auto& [extent, group] : alike) {
    for (const size_t c : group) wanted[c] = 1;
  }
  const auto places = PlacesOfComponents(mesh, components, wanted, poll);
  for (auto& [extent, group] : alike) {
    std::stable_sort(group.begin(), group.end(),
                     [&](size_t a, size_t b) { return places[a] < places[b]; });
    for (size_t i = 1; i < group.size(); ++i) {
      repeated[group[i]] = places[group[i]] == places[group[i - 1]];
    }
  }
  const int64_t dropped = std::count(repeated.begin(), repeated.end(), 1);
  if (dropped == 0) return 0;
  size_t kept = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (repeated[static_cast<size_t>(components.of_triangle[t])] != 0) continue;
    mesh.triangles[kept++] = mesh.triangles[t];
  }
  mesh.triangles.resize(kept);
  return dropped;
}

}  // namespace amhex
