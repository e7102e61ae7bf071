// Collects the cells that a reader finds and turns them into a VolumeMesh.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "amhex/input_hull.h"
#include "amhex/volume_mesh.h"

namespace amhex::client {

// VTK's numbers of cell types that cells of three dimensions have.
inline constexpr int kVtkVoxel = 11;
inline constexpr int kVtkPentagonalPrism = 15;
inline constexpr int kVtkHexagonalPrism = 16;
inline constexpr int kVtkPolyhedron = 42;

class VolumeBuilder {
 public:
  VolumeMesh mesh;  // vertices are the reader's to fill in
  // The cells of `mesh` as hexahedra, perhaps collapsed, as long as each of them is one.
  std::vector<CellCorners> hexahedra;

  // A cell of a VTK type whose vertices say all about it. Cells of fewer dimensions are skipped,
  // faces that have collapsed left out. INVALID_ARGUMENT for other types, for a wrong number of
  // vertices and for vertices that are not there.
  absl::Status AddCell(int64_t vtk_type, std::span<const int64_t> vertices);

  // VTK's face stream: the number of faces, then of each face the number of corners and the
  // corners.
  absl::Status AddPolyhedron(std::span<const int64_t> stream);

  void AddCorners(const CellCorners& corners);

 private:
  absl::Status CheckVertices(std::span<const int64_t> vertices) const;
};

}  // namespace amhex::client
