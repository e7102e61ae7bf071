// Which faces of neighbouring cubes could be glued; usable where bodies run. Paper: section 5.1,
// "Matching Scores".
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "base/arc_tangent.h"
#include "geometry/cubes_view.h"
#include "geometry/merge_view.h"
#include "geometry/point_bins_view.h"

namespace amhex {

// Worst score (in four mean sizes) that is ever merged: the last level of match_and_merge.cpp.
inline constexpr double kMaxScore = 0.8;
// A pair that the fields link has this share of its score.
inline constexpr double kLinkFactor = 0.5;

// How two faces fit: all that eq. 5 takes of them.
struct FaceFit {
  double distance = 0;   // of the paired corners, summed, for the best of the four rotations
  double cosine = 0;     // of the faces' normals, in [-1, 1]
  int32_t rotation = 0;  // corner q of face a meets corner (rotation + 4 - q) % 4 of face b
};

AMHEX_HD inline FaceFit FitOfFaces(const CubesView& cubes, int cube_a, int direction_a, int cube_b,
                                   int direction_b) {
  std::array<Vec3d, 4> u, v;
  for (int q = 0; q < 4; ++q) {
    u[q] = cubes.VirtualVertex(8 * cube_a + CornerOfFace(direction_a, q));
    v[q] = cubes.VirtualVertex(8 * cube_b + CornerOfFace(direction_b, q));
  }
  FaceFit best{1e300, 0, 0};
  for (int rotation = 0; rotation < 4; ++rotation) {
    double sum = 0;
    for (int q = 0; q < 4; ++q) sum += Norm(u[q] - v[(rotation + 4 - q) % 4]);
    if (sum < best.distance) best.distance = sum, best.rotation = rotation;
  }
  const double cosine =
      Dot(cubes.FaceNormal(cube_a, direction_a), cubes.FaceNormal(cube_b, direction_b));
  best.cosine = Smaller(Larger(cosine, -1.0), 1.0);
  return best;
}

// Eq. 5.
AMHEX_HD inline double ValueOf(const FaceFit& fit) {
  const double sine = std::sqrt((1 - fit.cosine) * (1 + fit.cosine));
  return fit.distance * (2.0 - ArcTangent2(sine, fit.cosine) * std::numbers::inv_pi);
}

// Two cube faces, numbered 6 * cube + direction, that the fields link; `low` < `high`.
struct LinkedFaces {
  int64_t low = 0, high = 0;
  AMHEX_HD bool operator<(const LinkedFaces& other) const {
    return low != other.low ? low < other.low : high < other.high;
  }
};

// One element per cube.
struct CandidateSearch {
  using Item = FacePair;
  CubesView cubes;
  PointBinsView bins;                  // of the cubes' centres
  ArrayView<const LinkedFaces> links;  // ascending

  template <class Visit>
  void VisitArrays(const Visit& visit) {
    cubes.VisitArrays(visit);
    visit(bins.keys), visit(bins.begin), visit(bins.order), visit(links);
    bins.points = cubes.centre;
  }

  // Calls visit(pair) for every candidate of the cube and a smaller one (of equal ones, with a
  // larger index), whose neighbourhood need not reach as far.
  template <class Visit>
  AMHEX_HD void VisitItems(int64_t cube, const Visit& visit) const {
    const auto a = static_cast<int32_t>(cube);
    const double half = cubes.mean_half[a];
    bins.ForEachWithin(cubes.centre[a], kMaxCentreDistance * 2 * half, [&](int32_t b) {
      const double other = cubes.mean_half[b];
      if (half > other || (half == other && a < b)) VisitBetween(a, b, visit);
    });
  }

 private:
  // Cubes farther apart than this many of their sizes cannot share a face.
  static constexpr double kMaxCentreDistance = 1.7;
  // Cosine between a face normal and the line of centres (about 53 degrees).
  static constexpr double kMinFacing = 0.6;

  template <class Visit>
  AMHEX_HD void VisitBetween(int32_t a, int32_t b, const Visit& visit) const {
    const Vec3d d = cubes.centre[b] - cubes.centre[a];
    const double distance = Norm(d);
    const double size = cubes.mean_half[a] + cubes.mean_half[b];
    if (distance > kMaxCentreDistance * size) return;
    for (int u = 0; u < kDirectionCount; ++u) {
      if (Dot(cubes.FaceNormal(a, u), d) < kMinFacing * distance) continue;
      for (int v = 0; v < kDirectionCount; ++v) {
        if (Dot(cubes.FaceNormal(b, v), d) > -kMinFacing * distance) continue;
        const FaceFit fit = FitOfFaces(cubes, a, u, b, v);
        double score = ValueOf(fit) / (4 * size);
        if (AreLinked(6 * int64_t{a} + u, 6 * int64_t{b} + v)) score *= kLinkFactor;
        if (score >= kMaxScore || cubes.AreApart(a, b)) continue;
        visit(FacePair{score, a, b, static_cast<uint8_t>(u), static_cast<uint8_t>(v),
                       static_cast<uint8_t>(fit.rotation)});
      }
    }
  }

  AMHEX_HD bool AreLinked(int64_t face_a, int64_t face_b) const {
    const LinkedFaces wanted{Smaller(face_a, face_b), Larger(face_a, face_b)};
    int64_t first = 0, last = links.size;
    while (first < last) {
      const int64_t middle = (first + last) / 2;
      if (links[middle] < wanted) {
        first = middle + 1;
      } else {
        last = middle;
      }
    }
    return first < links.size && !(wanted < links[first]);
  }
};

}  // namespace amhex
