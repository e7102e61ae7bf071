// The sites of the diagram as they travel from population through relaxation to the cubes.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "amhex/vec3.h"
#include "base/axis_frame.h"

namespace amhex {

// Unit quaternion w + xi + yj + zk.
struct Quaternion {
  double w = 1, x = 0, y = 0, z = 0;
};

// Directions -x +x -y +y -z +z of a site's own axes are numbered 0..5; the cube face that looks
// that way has the same number, and direction ^ 1 is the opposite one.
inline constexpr int kDirectionCount = 6;

// Two cube faces that the fields say should be glued.
struct FaceLink {
  int32_t site_a = 0;
  int32_t site_b = 0;
  uint8_t direction_a = 0;
  uint8_t direction_b = 0;
  int32_t votes = 0;
};

// Inside sites only, once relaxation is done; every array but the notes has site_count entries.
struct Sites {
  std::vector<Vec3d> position;      // edge lengths (normalised frame)
  std::vector<AxisFrame> frame;     // orthonormal, right-handed
  std::vector<Vec3d> size;          // wanted cell extent along each axis, edge lengths
  std::vector<double> cell_volume;  // of the Chebyshev cell; 0 = not measured, use the size
  std::vector<FaceLink> links;      // sorted by (site_a, direction_a, site_b); empty after grids
  std::vector<std::string> device_notes;  // why steps that were to run on a device did not

  int64_t count() const { return static_cast<int64_t>(position.size()); }
};

}  // namespace amhex
