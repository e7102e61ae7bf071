#include "page/report_data.h"

#include <algorithm>
#include <deque>
#include <limits>

#include "absl/container/flat_hash_map.h"
#include "cells/boundary.h"
#include "cells/cells.h"

namespace amhex::client {

absl::StatusOr<std::vector<CellNeighbours>> NeighboursOf(const AtMostHexaMesh& mesh) {
  if (const auto boundary = BoundaryOf(mesh, {}); !boundary.ok()) return boundary.status();
  constexpr CellNeighbours kNone = {kVanished, kVanished, kVanished,
                                    kVanished, kVanished, kVanished};
  struct Side {
    int32_t cell;
    int side;
  };
  std::vector<CellNeighbours> neighbours(mesh.corners.size(), kNone);
  absl::flat_hash_map<std::array<int32_t, 4>, Side> open;
  for (size_t cell = 0; cell < mesh.corners.size(); ++cell) {
    const FaceList faces = FacesOfCell(mesh.corners[cell]);
    for (int f = 0; f < faces.count; ++f) {
      std::array<int32_t, 4> key = faces.face[f].vertex;
      std::sort(key.begin(), key.end());
      const auto here = static_cast<int32_t>(cell);
      const auto [entry, is_new] = open.try_emplace(key, Side{here, faces.side[f]});
      neighbours[cell][faces.side[f]] = is_new ? kOnHull : entry->second.cell;
      if (is_new) continue;
      neighbours[entry->second.cell][entry->second.side] = here;
      open.erase(entry);
    }
  }
  return neighbours;
}

std::vector<uint16_t> LayersOf(const std::vector<CellNeighbours>& neighbours) {
  constexpr uint16_t kFar = std::numeric_limits<uint16_t>::max();
  std::vector<uint16_t> layers(neighbours.size(), kFar);
  std::deque<int32_t> queue;
  for (size_t cell = 0; cell < neighbours.size(); ++cell) {
    const CellNeighbours& around = neighbours[cell];
    if (std::find(around.begin(), around.end(), kOnHull) == around.end()) continue;
    layers[cell] = 0;
    queue.push_back(static_cast<int32_t>(cell));
  }
  while (!queue.empty()) {
    const int32_t cell = queue.front();
    queue.pop_front();
    for (int32_t other : neighbours[cell]) {
      if (other < 0 || layers[other] != kFar) continue;
      layers[other] = static_cast<uint16_t>(std::min<int>(layers[cell] + 1, kFar - 1));
      queue.push_back(other);
    }
  }
  return layers;
}

EdgeLengths EdgeLengthsOf(const AtMostHexaMesh& mesh) {
  std::vector<std::array<int32_t, 2>> edges;
  for (const CellCorners& corners : mesh.corners) {
    for (const Face& face : FacesOfCell(corners)) {
      for (int i = 0; i < face.count; ++i) {
        const int32_t from = face.vertex[i], to = face.vertex[(i + 1) % face.count];
        if (from < to) edges.push_back({from, to});
      }
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  EdgeLengths lengths;
  lengths.count = static_cast<int64_t>(edges.size());
  if (edges.empty()) return lengths;
  std::vector<double> all;
  all.reserve(edges.size());
  for (const auto& [from, to] : edges) all.push_back(Norm(mesh.vertices[from] - mesh.vertices[to]));
  lengths.least = *std::min_element(all.begin(), all.end());
  lengths.most = *std::max_element(all.begin(), all.end());
  for (double length : all) lengths.mean += length / static_cast<double>(all.size());
  for (double length : all) {
    const double place = length / lengths.mean / EdgeLengths::kBinsEnd * EdgeLengths::kBins;
    ++lengths.bins[static_cast<size_t>(std::min(place, EdgeLengths::kBins - 1.0))];
  }
  return lengths;
}

}  // namespace amhex::client
