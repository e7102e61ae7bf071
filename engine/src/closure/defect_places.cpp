#include "closure/defect_places.h"

#include <algorithm>

#include "geometry/point_bins.h"

namespace amhex {
namespace {

constexpr double kPlaceReach = 3.0;  // edge lengths

}  // namespace

std::vector<std::vector<int32_t>> PlacesOf(const std::vector<int32_t>& vertices,
                                           const WorkingMesh& mesh) {
  std::vector<Vec3d> points;
  points.reserve(vertices.size());
  for (const int32_t v : vertices) points.push_back(mesh.vertices()[v]);
  const PointBins bins(points, kPlaceReach);
  std::vector<std::vector<int32_t>> places;
  std::vector<uint8_t> is_placed(points.size(), 0);
  std::vector<size_t> pending;
  for (size_t first = 0; first < points.size(); ++first) {
    if (is_placed[first]) continue;
    places.emplace_back();
    is_placed[first] = 1;
    pending.push_back(first);
    while (!pending.empty()) {
      const size_t next = pending.back();
      pending.pop_back();
      places.back().push_back(vertices[next]);
      bins.ForEachWithin(points[next], kPlaceReach, [&](int i) {
        if (is_placed[i]) return;
        is_placed[i] = 1;
        pending.push_back(static_cast<size_t>(i));
      });
    }
    std::sort(places.back().begin(), places.back().end());
  }
  return places;
}

}  // namespace amhex
