// A place where the boundary of a placed mesh stays too far from the hull, with all around it that
// may be looked at or moved to mend it: so what mending costs does not grow with the mesh.
#pragma once

#include <optional>
#include <vector>

#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "closure/excerpt.h"
#include "closure/working_mesh.h"
#include "input/hull.h"
#include "optimize/hull_deviation.h"
#include "optimize/hull_features.h"
#include "optimize/place_refill.h"
#include "optimize/place_vertices.h"
#include "optimize/seat_excerpt.h"

namespace amhex {

// What all places of one mesh have in common.
struct GapsWith : RefillWith {
  const DeviationLimits limits;
  const FaceDetail detail;
};

// Whether a gap is between hull and boundary: an input point may be on neither.
bool IsOfHull(const Gap& gap, const GapsWith& with);

class GapPlace {
 public:
  // `with` must outlive it. O(vertices of the whole).
  GapPlace(const WorkingMesh& whole, const Gap& gap, const GapsWith& with);

  // The part with the boundary changed at the gap (SeatsAt), one for each way that was found,
  // nearest to the hull first, those filled anew, which cost hexahedra, behind all others but those
  // that have come hardly nearer; not yet drawn there.
  struct Candidate {
    size_t seat = 0;
    PlacementEffort effort = PlacementEffort::kJoint;
    CellComplex part;     // of the seat's excerpt
    double distance = 0;  // largest one near the place
  };
  std::vector<Candidate> Candidates() const;
  // Such a part, drawn to the hull; nothing where too little of the distance goes, or the run
  // stops.
  std::optional<CellComplex> Drawn(Candidate candidate) const;
  // The whole with a drawn part; nothing where it does not fit.
  std::optional<WorkingMesh> InWhole(const WorkingMesh& whole, const CellComplex& drawn) const;

  // Whether the place decides about what is at `p`; whether that is where cells come and go.
  bool Covers(const Vec3d& p) const { return Norm(p - gap_.sample) < kCovered; }
  bool IsNear(const Vec3d& p) const { return Norm(p - gap_.sample) < kNear; }
  // Gaps beyond this distance that a drawn part leaves where it covers, farthest first.
  std::vector<Gap> GapsIn(CellComplex drawn, double beyond) const;

 private:
  static constexpr double kCovered = 5.0, kNear = 2.0;  // edge lengths

  bool IsRefilled(const Candidate& candidate) const {
    return seats_[candidate.seat].use() == SeatUse::kRefill;
  }
  bool IsUnlikely(const Candidate& candidate) const;
  // The gap's distance without a share of what it is beyond the limit.
  double WithoutShare(double share) const;
  Surroundings Sampled() const;
  double LargestDistance(const CellComplex& part) const;
  // Draws what is beyond the limit near the gap. Returns the largest distance beyond it then.
  double Draw(CellComplex& part) const;
  Placement Prepare(CellComplex& part) const;

  const Gap gap_;
  const GapsWith& with_;
  const StopPoll poll_;
  const Vec3d on_hull_, on_mesh_;
  const Excerpt excerpt_;
  const WorkingMesh closed_;  // the excerpt by itself
  std::vector<SeatExcerpt> seats_;
  std::vector<Vec3d> samples_;  // of the hull near the gap
};

}  // namespace amhex
