// What the report page computes with, worked out of a mesh.
#pragma once

#include <array>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/volume_mesh.h"

namespace amhex::client {

inline constexpr int32_t kOnHull = -1;          // the face belongs to one cell only
inline constexpr int32_t kVanished = -2;        // the cell has no such face after its collapses
using CellNeighbours = std::array<int32_t, 6>;  // by FaceList::side

// The cell behind each face of each cell. DATA_LOSS if the cells do not fit together.
absl::StatusOr<std::vector<CellNeighbours>> NeighboursOf(const AtMostHexaMesh& mesh);

// 0 for cells with a face on the hull, else one more than the least of the neighbours.
std::vector<uint16_t> LayersOf(const std::vector<CellNeighbours>& neighbours);

struct EdgeLengths {
  static constexpr int kBins = 40;
  static constexpr double kBinsEnd = 2.5;  // of the mean; longer edges count in the last bin
  int64_t count = 0;
  double least = 0, mean = 0, most = 0;
  std::array<int64_t, kBins> bins{};
};

// Over the mesh's edges, each once.
EdgeLengths EdgeLengthsOf(const AtMostHexaMesh& mesh);

}  // namespace amhex::client
