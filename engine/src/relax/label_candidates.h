// The sites that may own a point of one lattice tile, and the arithmetic over all of them at once.
//
// Arrays instead of structs, and loops of fixed form, so that the host compiler turns them into
// vector instructions.
#pragma once

#include <cstdint>

#include "base/platform.h"
#include "relax/cell_moments.h"
#include "relax/site_metric.h"

namespace amhex {

// Twice what a tile of the coarsest lattice (8 points per site) meets; tiles with more fall back
// to looking at every near site for every point.
inline constexpr int kCandidateCapacity = 192;
// Added to culling bounds, edge lengths: far above the rounding of float coordinates.
inline constexpr float kCullSlack = 1e-3f;

// Ascending by id, so that the first of equal distances has the smallest id.
struct LabelCandidates {
  int count = 0;
  int32_t id[kCandidateCapacity];
  float x[kCandidateCapacity], y[kCandidateCapacity], z[kCandidateCapacity];
  float row[9][kCandidateCapacity];
  float reach[3][kCandidateCapacity];

  // `sites` is the array that the ids point into.
  AMHEX_HD void Load(const SiteMetric* sites) {
    for (int k = 0; k < count; ++k) {
      const SiteMetric& site = sites[id[k]];
      x[k] = site.x;
      y[k] = site.y;
      z[k] = site.z;
      for (int i = 0; i < 9; ++i) row[i][k] = site.row[i];
      for (int i = 0; i < 3; ++i) reach[i][k] = site.reach[i];
    }
  }

  AMHEX_HD void SortById() {
    for (int k = 1; k < count; ++k) {
      const int32_t inserted = id[k];
      int slot = k;
      for (; slot > 0 && id[slot - 1] > inserted; --slot) id[slot] = id[slot - 1];
      id[slot] = inserted;
    }
  }
};

// Lower and upper bounds of every candidate's distance over a cube; see BoundsOverCube.
[[maybe_unused]] AMHEX_VECTOR_CLONES AMHEX_HD static void BoundCandidates(
    const LabelCandidates& candidates, const Vec3f& centre, float half_width, float* lower,
    float* upper) {
  const LabelCandidates& c = candidates;
  for (int k = 0; k < c.count; ++k) {
    const float dx = centre.x - c.x[k];
    const float dy = centre.y - c.y[k];
    const float dz = centre.z - c.z[k];
    float low = -kUnboundedReach;
    float high = 0;
    for (int a = 0; a < 3; ++a) {
      const float d = AbsoluteValue(
          FusedMultiplyAdd(c.row[3 * a][k], dx,
                           FusedMultiplyAdd(c.row[3 * a + 1][k], dy, c.row[3 * a + 2][k] * dz)));
      const float spread = half_width * c.reach[a][k];
      low = Larger(low, d - spread);
      high = Larger(high, d + spread);
    }
    lower[k] = low;
    upper[k] = high;
  }
}

// For the 32 points of the block at `base`: owned[i] gets the mask of the points nearer to
// candidate chosen[i] than to any other chosen one, and nearer than `limit`.
[[maybe_unused]] AMHEX_VECTOR_CLONES AMHEX_HD static void OwnPoints(
    const LabelCandidates& candidates, const int32_t* chosen, int chosen_count,
    const LatticePoint& base, double spacing, float limit, uint32_t* owned) {
  float x[kBlockPoints], y[kBlockPoints], z[kBlockPoints];
  float nearest[kBlockPoints];
  int32_t owner[kBlockPoints];
  for (int p = 0; p < kBlockPoints; ++p) {
    const LatticePoint q = PointInBlock(p);
    x[p] = static_cast<float>((base.x + q.x) * spacing);
    y[p] = static_cast<float>((base.y + q.y) * spacing);
    z[p] = static_cast<float>((base.z + q.z) * spacing);
    nearest[p] = limit;
    owner[p] = -1;
  }
  for (int i = 0; i < chosen_count; ++i) {
    const int k = chosen[i];
    const LabelCandidates& c = candidates;
    const float sx = c.x[k], sy = c.y[k], sz = c.z[k];
    const float r0 = c.row[0][k], r1 = c.row[1][k], r2 = c.row[2][k];
    const float r3 = c.row[3][k], r4 = c.row[4][k], r5 = c.row[5][k];
    const float r6 = c.row[6][k], r7 = c.row[7][k], r8 = c.row[8][k];
    for (int p = 0; p < kBlockPoints; ++p) {
      const float dx = x[p] - sx, dy = y[p] - sy, dz = z[p] - sz;
      const float a = AbsoluteValue(FusedMultiplyAdd(r0, dx, FusedMultiplyAdd(r1, dy, r2 * dz)));
      const float b = AbsoluteValue(FusedMultiplyAdd(r3, dx, FusedMultiplyAdd(r4, dy, r5 * dz)));
      const float d = AbsoluteValue(FusedMultiplyAdd(r6, dx, FusedMultiplyAdd(r7, dy, r8 * dz)));
      const float distance = Larger(Larger(a, b), d);
      const bool is_nearer = distance < nearest[p];
      nearest[p] = is_nearer ? distance : nearest[p];
      owner[p] = is_nearer ? i : owner[p];
    }
  }
  for (int i = 0; i < chosen_count; ++i) {
    uint32_t mask = 0;
    for (int p = 0; p < kBlockPoints; ++p) mask |= owner[p] == i ? 1u << p : 0u;
    owned[i] = mask;
  }
}

}  // namespace amhex
