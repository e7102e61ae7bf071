// The workhorse of the closure: a region filled by a star with a free patch on the hull, the
// region growing over neighbouring cells until the best star is found.
#pragma once

#include <optional>
#include <vector>

#include "amhex/run_context.h"
#include "closure/region.h"

namespace amhex {

// A complete filling of a region, not yet applied.
struct StarFilling {
  double cost = 1e9;
  double quality = 0;  // minimum scaled Jacobian of the new cells
  Vec3d apex;
  Region region;
  std::vector<CellFace> faces;  // walls kept, hull faces kept and patch, looking in
  std::vector<CellFace> patch;  // the part of `faces` that becomes hull
  // For an apex on the hull: the loop whose edges form hull triangles with it, looking in.
  std::vector<int32_t> rim;
};

// What absorbing and creating cells costs, in cells.
struct FillWeights {
  double hexahedron_lost = 1.0;
  double other_removed = -0.9;  // a gain
  // Per unit that the worst new cell lacks to `good_quality`. While cavities are open, few cells
  // count for more than good ones: repairs come later, and vertices move before that.
  double poor_quality = 80;
  double good_quality = 0.25;
};

// Evaluates the stars of one region and keeps the better of them and `best`.
void EvaluateRegion(const WorkingMesh& mesh, const Hull& hull, const FillWeights& weights,
                    const Region& region, StarFilling* best);

struct GrowthLimits {
  int depth = 6;  // cells absorbed at most beyond the seed
  int beam_width = 6;
  size_t max_walls = 120;
  double enough_quality = 0.3;      // stop growing once reached and no longer improving
  bool forbid_cavities = false;     // repairs must not touch open cavities
  double min_seed_depth = -1e300;   // seeds with a shallower kernel are not tried
  const RunContext* run = nullptr;  // polled between depths if set
};

// Grows `seeds` over neighbouring cells by beam search; returns the best filling cheaper than
// `cost_to_beat`, if any.
std::optional<StarFilling> GrowStar(const WorkingMesh& mesh, const Hull& hull,
                                    const Cavities& cavities, const FillWeights& weights,
                                    const GrowthLimits& limits, std::vector<Region> seeds,
                                    double cost_to_beat);

// Replaces the region's cells by the star; returns the apex's vertex id.
int ApplyStar(const StarFilling& filling, WorkingMesh* mesh);

// True if two faces have the same vertices.
bool HasRepeatedFace(const std::vector<CellFace>& faces);

// Penalty for cells below the quality that is asked of fillings, in cells.
double QualityPenalty(const FillWeights& weights, double quality);

}  // namespace amhex
