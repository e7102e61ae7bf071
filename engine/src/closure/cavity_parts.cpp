#include "closure/cavity_parts.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <utility>

namespace amhex {

std::vector<std::vector<int>> FaceNeighbours(const std::vector<CellFace>& faces) {
  std::map<std::pair<int32_t, int32_t>, std::vector<int>> at_edge;
  for (size_t f = 0; f < faces.size(); ++f) {
    for (int j = 0; j < faces[f].count; ++j) {
      at_edge[std::minmax(faces[f].v[j], faces[f].v[(j + 1) % faces[f].count])].push_back(
          static_cast<int>(f));
    }
  }
  std::vector<std::vector<int>> neighbours(faces.size());
  for (const auto& [edge, users] : at_edge) {
    for (const int a : users) {
      for (const int b : users) {
        if (a != b) neighbours[a].push_back(b);
      }
    }
  }
  return neighbours;
}

std::vector<int> PartAround(const std::vector<CellFace>& faces, const std::vector<Vec3d>& centres,
                            const std::vector<std::vector<int>>& neighbours, int seed,
                            double radius) {
  std::vector<int> part = {seed};
  std::vector<uint8_t> seen(faces.size(), 0);
  seen[seed] = 1;
  for (size_t i = 0; i < part.size(); ++i) {
    for (const int next : neighbours[part[i]]) {
      if (seen[next] || Norm(centres[next] - centres[seed]) > radius) continue;
      seen[next] = 1;
      part.push_back(next);
    }
  }
  std::sort(part.begin(), part.end());
  return part;
}

}  // namespace amhex
