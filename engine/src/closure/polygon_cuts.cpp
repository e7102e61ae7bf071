#include "closure/polygon_cuts.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace amhex {
namespace {

using Cut = std::vector<CellFace>;

std::vector<Cut> CutsOf(const std::vector<int32_t>& polygon, size_t most_triangles);

size_t CountTriangles(const Cut& cut) {
  return static_cast<size_t>(
      std::count_if(cut.begin(), cut.end(), [](const CellFace& face) { return face.count == 3; }));
}

// The cuts that have the face whose corners are the polygon's vertices at `corners`, ascending, the
// first and the last among them: all combinations of the cuts of what lies beside it.
std::vector<Cut> CutsWith(const std::vector<int32_t>& polygon, const std::vector<size_t>& corners,
                          size_t most_triangles) {
  if (corners.size() == 3 && most_triangles == 0) return {};
  Cut first(1);
  first[0].count = static_cast<int>(corners.size());
  for (size_t i = 0; i < corners.size(); ++i) first[0].v[i] = polygon[corners[i]];
  std::vector<Cut> cuts = {first};
  for (size_t i = 0; i + 1 < corners.size() && !cuts.empty(); ++i) {
    const std::vector<int32_t> beside(polygon.begin() + static_cast<int64_t>(corners[i]),
                                      polygon.begin() + static_cast<int64_t>(corners[i + 1]) + 1);
    std::vector<Cut> longer;
    for (const Cut& cut : cuts) {
      for (const Cut& more : CutsOf(beside, most_triangles - CountTriangles(cut))) {
        longer.push_back(cut);
        longer.back().insert(longer.back().end(), more.begin(), more.end());
      }
    }
    cuts = std::move(longer);
  }
  return cuts;
}

// By the face at the edge from the last vertex to the first. An edge alone is cut in one way, into
// nothing.
std::vector<Cut> CutsOf(const std::vector<int32_t>& polygon, size_t most_triangles) {
  if (polygon.size() < 3) return {Cut()};
  const size_t last = polygon.size() - 1;
  std::vector<Cut> cuts;
  const auto append = [&](const std::vector<size_t>& corners) {
    for (Cut& cut : CutsWith(polygon, corners, most_triangles)) cuts.push_back(std::move(cut));
  };
  for (size_t k = 1; k < last; ++k) {
    append({0, k, last});
    for (size_t l = k + 1; l < last; ++l) append({0, k, l, last});
  }
  return cuts;
}

}  // namespace

std::vector<std::vector<CellFace>> CutPolygon(const std::vector<int32_t>& polygon,
                                              size_t most_triangles) {
  if (polygon.size() < 3) return {};
  return CutsOf(polygon, most_triangles);
}

}  // namespace amhex
