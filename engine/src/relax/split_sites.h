// Split Cells of section 4.4: a site that too many others take for their neighbour becomes two.
#pragma once

#include <cstdint>
#include <vector>

#include "amhex/vec3.h"
#include "relax/cell_moments.h"
#include "relax/relaxation_task.h"

namespace amhex {

// A cell below this many times its wanted volume has no room for two.
inline constexpr double kLeastSplitVolume = 1.3;

// Whether a cluster is split: claimed by at least `split_limit` sites, and large enough.
struct SplitCriterion {
  int32_t split_limit = 10;
  double point_volume = 0;

  AMHEX_HD bool operator()(int32_t claim_count, int64_t point_count, const Vec3f& size) const {
    return claim_count >= split_limit &&
           static_cast<double>(point_count) * point_volume >
               kLeastSplitVolume * static_cast<double>(size.x * size.y * size.z);
  }
};

// Unit direction in which the points of a cell spread most; its largest component is positive.
// Needs second moments and at least one point.
Vec3d PrincipalDirection(const CellMoments& moments);

// Splits inside sites by the criterion: the site moves a quarter of its size along its cell's
// principal direction, the new one (appended) is its mirror image. Existing ids stay. Returns the
// number of splits; the task never exceeds `site_limit` sites.
int64_t SplitClusters(const std::vector<int32_t>& claim_count,
                      const std::vector<CellMoments>& moments, int64_t site_limit,
                      RelaxationTask& task);

}  // namespace amhex
