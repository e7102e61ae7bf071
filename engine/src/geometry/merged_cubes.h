// What section 5.1 hands to the topology: cubes whose virtual vertices have been merged.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "amhex/vec3.h"
#include "amhex/volume_mesh.h"

namespace amhex {

struct MergedCubes {
  std::vector<Vec3d> vertices;       // [vertex_count] average of each merge set, edge lengths
  std::vector<uint8_t> on_hull;      // [vertex_count] 1 if a hull face uses it (then projected)
  std::vector<CellCorners> corners;  // [cube_count] vertex ids; repeated where an edge collapsed
  // [cube_count] bit d set: the face in direction d (sites.h) lies on the hull.
  std::vector<uint8_t> hull_faces;
  // [cube_count][direction] 6 * other cube + direction over there, or -1 while open.
  std::vector<std::array<int32_t, 6>> matches;
  std::vector<std::string> device_notes;  // why steps that were to run on a device did not
};

}  // namespace amhex
