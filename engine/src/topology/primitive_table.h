// All primitives that may become cells of the mesh. Section 5.2, II.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "amhex/volume_mesh.h"
#include "topology/face_table.h"

namespace amhex {

// One at-most-hexa primitive: valid on its own (CellQuality > 0), in conflict with others perhaps.
struct Primitive {
  CellCorners corners{};
  PrimitiveType type = PrimitiveType::kHexahedron;
  int8_t face_count = 0;
  int32_t cube = -1;  // the merged cube whose cell it is, or -1 if the search found it
  double quality = 0;
  std::array<HalfFaceId, 6> half_faces{};  // the first face_count, as the cell sees them outward
};

struct PrimitiveTable {
  FaceTable faces;               // of all primitives, and of the leftovers' edge network
  std::vector<uint8_t> on_hull;  // [half_face_count] 1 if a cube declares it part of the hull
  std::vector<Primitive> primitives;
  int32_t initial_count = 0;  // primitives [0, initial_count) start the mesh (listing 3)
  std::vector<std::string> device_notes;  // why steps that were to run on a device did not
};

}  // namespace amhex
