// The cube that materialises a site's cell. Paper: section 5.1, Figure 7.
//
// Virtual vertex `8 * cube + corner` and cube face `6 * cube + direction` are never stored: their
// numbers say it all. Corners are VTK_HEXAHEDRON's (volume_mesh.h), directions those of sites.h.
#pragma once

#include <array>
#include <vector>

#include "amhex/vec3.h"
#include "geometry/cubes_view.h"
#include "relax/sites.h"
#include "topology/primitives.h"

namespace amhex {

struct Cubes {
  std::vector<Vec3d> centre;       // [cube_count] edge lengths
  std::vector<AxisFrame> frame;    // [cube_count]
  std::vector<Vec3d> half_extent;  // [cube_count] along the cube's own axes
  std::vector<double> mean_half;   // [cube_count] mean of the three half extents

  int count() const { return static_cast<int>(centre.size()); }
  Vec3d VirtualVertex(int id) const;
  Vec3d FaceNormal(int cube, int direction) const;
  Vec3d FaceCentre(int cube, int direction) const;
  // Where bodies run; must not outlive this.
  CubesView view() const;
};

// Scales every cube to its cell: the wanted size, corrected by the measured cell volume within
// bounds. One cube per site, same order. O(n).
Cubes MaterializeCubes(const Sites& sites);

}  // namespace amhex
