// The result: an at-most-hexa mesh and its measures.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "amhex/vec3.h"

namespace amhex {

// Cell kinds of the paper's Figure 2; the values are the paper's numbers.
enum class PrimitiveType : uint8_t {
  kTetrahedron = 1,
  kPyramid = 4,
  kSlice = 5,
  kPrism = 6,
  kHexprism = 7,
  kHexahedron = 8,
};

inline constexpr std::array<PrimitiveType, 6> kPrimitiveTypes = {
    PrimitiveType::kHexahedron, PrimitiveType::kHexprism, PrimitiveType::kPrism,
    PrimitiveType::kSlice,      PrimitiveType::kPyramid,  PrimitiveType::kTetrahedron};

// Cells by type, indexed by PrimitiveType's value.
using CellCounts = std::array<int64_t, 9>;

// Eight vertex ids in VTK_HEXAHEDRON order; a collapsed edge repeats its id.
//
//        7-------6
//       /|      /|        bottom ring 0 1 2 3, top ring 4 5 6 7 above it
//      4-------5 |
//      | 3-----|-2
//      |/      |/
//      0-------1
using CellCorners = std::array<int32_t, 8>;

struct AtMostHexaMesh {
  std::vector<Vec3d> vertices;       // [vertex_count] the user's units
  std::vector<CellCorners> corners;  // [cell_count]
  std::vector<PrimitiveType> types;  // [cell_count]
  std::vector<float> quality;        // [cell_count] minimum scaled Jacobian of the cell, (0, 1]
};

// The columns of the paper's Table 1, and what a user needs to trust the mesh.
struct MeshStatistics {
  int64_t cell_count = 0;
  int64_t vertex_count = 0;
  int64_t boundary_face_count = 0;
  CellCounts cells_by_type{};
  double hexahedra_ratio = 0;          // [0, 1] by number
  double hexahedra_volume_ratio = 0;   // [0, 1] by volume
  double min_scaled_jacobian = 0;      // over all cells
  double average_scaled_jacobian = 0;  // mean of the cells' minima
  double min_scaled_jacobian_hexahedra = 0;
  double average_scaled_jacobian_hexahedra = 0;
  double volume = 0;       // user's units cubed
  double hull_volume = 0;  // volume enclosed by the input as understood by the engine
  // Two-sided distances between input and mesh boundary, in fractions of the input box's diagonal.
  double mesh_to_input_max = 0;
  double input_to_mesh_max = 0;
  double input_to_mesh_mean = 0;
  // From the input's sharp edges to the nearest edges of the mesh's boundary, in wanted edge
  // lengths; 0 where the input has none.
  double sharp_edge_deviation_rms = 0;
  double sharp_edge_deviation_max = 0;
  double edge_length = 0;    // the wanted edge length h, user's units
  double shortest_edge = 0;  // of all cells, user's units
  int64_t boundary_component_count = 0;
  int64_t genus = 0;                   // of the mesh boundary, summed over components
  bool distance_exceeds_cell = false;  // the mesh misses the input by more than h somewhere
};

}  // namespace amhex
