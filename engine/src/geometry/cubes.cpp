#include "geometry/cubes.h"

#include <algorithm>
#include <cmath>

namespace amhex {
namespace {

// A cell that is far from its wanted volume is a cluster or a gap, not a differently sized cube.
constexpr double kMinVolumeScale = 0.7;
constexpr double kMaxVolumeScale = 1.2;

}  // namespace

CubesView Cubes::view() const {
  const auto count = static_cast<int64_t>(centre.size());
  return {{centre.data(), count},
          {frame.data(), count},
          {half_extent.data(), count},
          {mean_half.data(), count}};
}

Vec3d Cubes::VirtualVertex(int id) const { return view().VirtualVertex(id); }

Vec3d Cubes::FaceNormal(int cube, int direction) const {
  return view().FaceNormal(cube, direction);
}

Vec3d Cubes::FaceCentre(int cube, int direction) const {
  return view().FaceCentre(cube, direction);
}

Cubes MaterializeCubes(const Sites& sites) {
  Cubes cubes;
  const size_t count = sites.position.size();
  cubes.centre = sites.position;
  cubes.frame = sites.frame;
  cubes.half_extent.resize(count);
  cubes.mean_half.resize(count);
  for (size_t i = 0; i < count; ++i) {
    const Vec3d& size = sites.size[i];
    double scale = 1.0;
    if (i < sites.cell_volume.size() && sites.cell_volume[i] > 0) {
      const double wanted = size.x * size.y * size.z;
      scale =
          std::clamp(std::cbrt(sites.cell_volume[i] / wanted), kMinVolumeScale, kMaxVolumeScale);
    }
    cubes.half_extent[i] = size * (0.5 * scale);
    const Vec3d& e = cubes.half_extent[i];
    cubes.mean_half[i] = (e.x + e.y + e.z) / 3.0;
  }
  return cubes;
}

}  // namespace amhex
