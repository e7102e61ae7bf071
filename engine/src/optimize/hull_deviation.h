// How far hull and mesh boundary are from each other around one vertex of the boundary, were it
// somewhere else.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "fields/point_index.h"
#include "input/hull.h"
#include "input/hull_queries.h"
#include "optimize/hull_features.h"
#include "optimize/nearest_on_face.h"
#include "optimize/placement.h"
#include "optimize/surroundings.h"

namespace amhex {

// Of the corners of a face.
Vec3d MiddleOf(const CellFace& face, const std::vector<Vec3d>& vertices);

// For distances from the complex' boundary, quads as four triangles around their middle. Throws
// RunStopped when `poll` does.
HullQueries BoundaryOf(const CellComplex& complex, const StopPoll& poll);

// What is asked of the whole boundary, edge lengths.
struct DeviationLimits {
  double limit = 0;      // of a distance between hull and boundary
  double free = 0;       // distances below this do not count
  double creases = 0.1;  // of the distance of a crease from the nearest edge of the boundary
  double mended = 0;     // what has come down to this is near enough, if more is aimed at
  // What a place's becoming near enough may cost where it is drawn jointly, in units of what
  // cells lack to a scaled Jacobian of 1.
  double worth = 0.5;
};
// The larger of 0.5 % of the diagonal of the hull's box and a sixth of an edge length.
DeviationLimits LimitsFor(const Hull& hull);

// What of the hull is farther than this from the boundary is lost: no cell reaches into it, and a
// vertex drawn towards it would only bend those before it.
inline constexpr double kLostDistance = 1.0;

// Samples so far beyond faces may still be nearest to them.
inline constexpr double kSamplesBeyondFaces = 0.35;
// From the middle of a face of the boundary to its corners, mostly.
inline constexpr double kFaceReach = 1.0;

struct Deviation {
  double largest = 0;  // distance, either way; those that do not count may be left out
  double cost = 0;     // sum over samples of the squared distance beyond DeviationLimits::free, and
                       // over those of creases of the squared distance
};

// A sample and the point of the other surface that is nearest to it.
struct Gap {
  Vec3d sample;
  Vec3d nearest;
  double distance = 0;
  bool is_of_boundary = false;  // the sample; it is the hull's or the input's otherwise
};

// Where a face of the boundary is held against the hull: in its middle, as it was at first (with
// all middles where they are now, twenty rows were as good and as bad), or in the places of
// face_places.
enum class FaceDetail : uint8_t { kFew, kClosely };

// Samples of the hull and of its creases, and the boundary's faces, by place. Vertices may move by
// a few tenths of an edge length after this is made. `placement`, `hull` must outlive it.
class HullSampling {
 public:
  // Where the placement is of a part of a mesh only: of what surrounds that part.
  // Throws RunStopped when `poll` does.
  HullSampling(const Hull& hull, const Placement& placement, const StopPoll& poll = {},
               const Surroundings& around = {});

  // Those of the hull farther than `distance` from the boundary, and places on faces farther than
  // that from the hull, farthest first; of those within the surroundings.
  std::vector<Gap> GapsBeyond(double distance, const StopPoll& poll,
                              FaceDetail detail = FaceDetail::kFew,
                              const Surroundings& around = {}) const;
  // Samples of creases farther than `distance` from any edge of the boundary, farthest first.
  std::vector<Gap> CreaseGapsBeyond(double distance, const StopPoll& poll,
                                    const Surroundings& around = {}) const;

  const Hull& hull() const { return hull_; }
  // Where the input's points do (HullFeatures), the hull is followed, and those that lie off it by
  // more than does not count are no samples.
  bool points_scatter() const { return placement_.features.points_scatter(); }
  const std::vector<Vec3d>& points() const { return points_; }
  const std::vector<Vec3d>& crease_points() const { return crease_points_; }
  const fields::PointIndex& point_index() const { return point_index_; }
  const fields::PointIndex& crease_index() const { return crease_index_; }
  const fields::PointIndex& face_index() const { return face_index_; }  // of the start

 private:
  std::vector<Gap> GapsTo(const HullQueries& boundary, double distance, const StopPoll& poll,
                          FaceDetail detail, const Surroundings& around) const;

  const Hull& hull_;
  const Placement& placement_;
  // At the start.
  const std::vector<Vec3d> vertices_;
  const HullQueries boundary_;
  std::vector<Vec3d> points_, crease_points_, face_middles_;
  fields::PointIndex point_index_, crease_index_, face_index_;
};

// Those that are not next to one before.
std::vector<Gap> DistinctGaps(const std::vector<Gap>& gaps, const StopPoll& poll);

// Everything near one vertex that its place decides about.
class VertexDeviation {
 public:
  // `placement` has the cells and faces of the sampling's, its vertices where they are now.
  VertexDeviation(const HullSampling& sampling, const Placement& placement,
                  const DeviationLimits& limits, int32_t vertex);

  // Of the boundary's faces that are not at the vertex, those matter that the index of faces visits
  // within this of it.
  double reach() const;

  // With the vertex at `position`. What costs more than `bound` is not looked at to the end.
  Deviation At(const Vec3d& position, double bound = 1e300);
  // The worst of each kind the last time that At came to an end; distance 0 if there is none.
  const Gap& worst_of_hull() const { return worst_of_hull_; }          // sample on the hull
  const Gap& worst_of_boundary() const { return worst_of_boundary_; }  // sample on the boundary
  const Gap& worst_of_creases() const { return worst_of_creases_; }

 private:
  struct Sample {
    Vec3d point;
    Vec3d nearest;  // on faces, or edges, that do not move
    double distance = 0;
  };
  // A face at the vertex: its corners, the vertex first, and a ball around it.
  struct Fan {
    int count = 0;
    Vec3d corner[4];
    Vec3d middle;
    double extent = 0;
    FaceInLanes lanes;
    std::array<int32_t, 3> likely = {-1, -1,
                                     -1};  // where the hull was near its places (HullQueries)
  };

  // A face not at the vertex, and a ball around it.
  struct OtherFace {
    Vec3d middle;
    double extent = 0;
    FaceInLanes lanes;
  };

  std::vector<OtherFace> FindOtherFaces() const;
  void FindSamples(const std::vector<OtherFace>& faces);
  bool Locate(const std::vector<OtherFace>& faces, Sample* sample) const;
  void FindCreaseSamples();
  void AddHullSamples(double bound, Deviation* deviation);
  void AddBoundarySamples(Deviation* deviation);
  void AddCreaseSamples(Deviation* deviation);
  void Count(double distance, Deviation* deviation) const;

  const HullSampling& sampling_;
  const Placement& placement_;
  const DeviationLimits& limits_;
  const int32_t vertex_;
  double reach_ = 0;  // of the faces at the vertex
  std::vector<Fan> fans_;
  std::vector<Sample> samples_, crease_samples_;
  Gap worst_of_hull_, worst_of_boundary_, worst_of_creases_;
};

}  // namespace amhex
