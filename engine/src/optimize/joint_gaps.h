// How far hull and boundary are from each other around vertices that move together, and how that
// changes with them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "optimize/hull_deviation.h"
#include "optimize/joint_place.h"
#include "optimize/nearest_on_face.h"
#include "optimize/placement.h"

namespace amhex {

struct JointDeviation {
  // Sums of squares beyond what is aimed at: nine tenths of the limits, and for vertices what does
  // not count.
  double cost = 0, cost_of_creases = 0;
  // The largest distance of what is beyond its aim; those of vertices are not among them.
  double largest = 0, largest_of_creases = 0;
  double total() const { return cost + cost_of_creases; }
};

// One object for one place after the other. What it was made with must outlive it.
class JointGaps {
 public:
  JointGaps(const HullSampling& sampling, const Placement& placement, const DeviationLimits& limits,
            FaceDetail detail = FaceDetail::kFew);

  // Goes to the faces at these vertices, and the samples that may be nearest to them. Points of the
  // input that lie so far off the hull that no boundary comes near them are left out. False if
  // there are no such faces, a vertex is far off the hull, or a sample is lost to them
  // (gap_closer).
  bool Enter(const std::vector<int32_t>& moving);

  // The vertices of all those faces, whose places decide what is found here.
  std::vector<int32_t> Seen() const;

  // As the vertices are.
  JointDeviation Judge();
  // Every distance beyond what is aimed at, and those within that a step might bring there. What is
  // beyond the limit weighs `far_weight` times as much.
  std::vector<VertexRow> Rows(double far_weight = 1);

 private:
  struct Face {
    int count = 0;
    std::array<int32_t, 4> vertex = {};
    std::array<Vec3d, 4> corner;
    Vec3d middle;
    double extent = 0;  // of a ball around the middle
    FaceInLanes lanes;
  };
  struct Sample {
    Vec3d point;
    size_t likely = 0;  // face that was nearest, index into faces_
  };
  // A point of a face: of the triangle of one side and the middle, or of the whole triangle.
  struct FacePoint {
    double distance = 1e300;
    Vec3d point;
    size_t face = 0;
    int side = 0;
  };
  struct EdgePoint {
    double distance = 1e300;
    Vec3d point;
    std::array<int32_t, 2> vertex = {-1, -1};
    double second_share = 0;
  };
  // A point of the boundary as a mean of vertices.
  struct Mean {
    Vec3d point;
    std::array<int32_t, 4> vertex = {-1, -1, -1, -1};
    std::array<double, 4> weight = {};
  };
  enum class Kind : uint8_t { kSurface, kCrease, kVertex };

  Face FaceNow(int32_t f) const;
  bool FindSamples(const Vec3d& middle, double reach);
  HalfLanes SquaredFromMiddles(const Vec3d& p, size_t block) const;
  size_t FaceNearMiddle(const Vec3d& p) const;
  void CollectBalls();
  void NoteBall(size_t f);
  void Renew();
  FacePoint NearestOnFaces(const Vec3d& p, size_t likely, double enough) const;
  EdgePoint NearestOnEdges(const Vec3d& p, double enough) const;
  Mean MeanAt(const FacePoint& at) const;
  template <class Visit>
  void VisitClosely(const Visit& visit) const;
  template <class Visit>
  void VisitOwnBoundary(const Visit& visit) const;
  double AimFor(Kind kind) const;
  // Calls visit(kind, distance, nearest point of the hull, mean) for all beyond a share of what is
  // aimed at; mean() is that point of the boundary.
  template <class Visit>
  void VisitDistances(double share, const Visit& visit);

  const HullSampling& sampling_;
  const Placement& placement_;
  const DeviationLimits& limits_;
  const FaceDetail detail_;
  std::vector<int32_t> moving_;     // those on the boundary
  std::vector<int32_t> own_ids_;    // hull faces at them, ascending
  std::vector<int> own_divisions_;  // of those, as they were on entering
  std::vector<Face> faces_;         // those first, then others around
  // Coordinates of their middles, and their extents, padded to whole lanes.
  std::array<std::vector<double>, 3> middles_;
  std::vector<double> extents_;
  std::vector<Sample> samples_;
  std::vector<Vec3d> crease_samples_;
  // [place of the boundary, in the order of visits] where the hull was near it (HullQueries).
  std::vector<int32_t> likely_;
};

}  // namespace amhex
