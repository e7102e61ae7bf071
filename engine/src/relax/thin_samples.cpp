#include "relax/thin_samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "amhex/vec3.h"

namespace amhex {
namespace {

constexpr double kCubesPerEdge = 3.0;
constexpr size_t kNormalsPerCube = 3;
// Normals farther apart than acos(0.8) = 37 degrees belong to different sides of a sharp edge.
constexpr double kSameNormal = 0.8;

using CubeKey = std::array<int64_t, 3>;

CubeKey KeyOf(const Vec3d& p) {
  return {static_cast<int64_t>(std::floor(p.x * kCubesPerEdge)),
          static_cast<int64_t>(std::floor(p.y * kCubesPerEdge)),
          static_cast<int64_t>(std::floor(p.z * kCubesPerEdge))};
}

}  // namespace

HullSamples ThinSamples(const HullSamples& samples) {
  std::vector<std::pair<CubeKey, size_t>> by_cube(samples.position.size());
  for (size_t i = 0; i < by_cube.size(); ++i) by_cube[i] = {KeyOf(samples.position[i]), i};
  std::sort(by_cube.begin(), by_cube.end());
  std::vector<size_t> kept;
  size_t first_of_cube = 0;
  for (size_t i = 0; i < by_cube.size(); ++i) {
    if (i == 0 || by_cube[i].first != by_cube[i - 1].first) first_of_cube = kept.size();
    const Vec3d& normal = samples.normal[by_cube[i].second];
    const bool is_known =
        std::any_of(kept.begin() + static_cast<std::ptrdiff_t>(first_of_cube), kept.end(),
                    [&](size_t k) { return Dot(samples.normal[k], normal) > kSameNormal; });
    if (!is_known && kept.size() - first_of_cube < kNormalsPerCube) {
      kept.push_back(by_cube[i].second);
    }
  }
  std::sort(kept.begin(), kept.end());
  HullSamples thinned;
  for (const size_t k : kept) {
    thinned.position.push_back(samples.position[k]);
    thinned.normal.push_back(samples.normal[k]);
    thinned.tangent.push_back(samples.tangent[k]);
    thinned.curvature_confidence.push_back(samples.curvature_confidence[k]);
  }
  return thinned;
}

}  // namespace amhex
