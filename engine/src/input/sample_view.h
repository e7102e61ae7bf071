// What samples of the hull are (sample_hull.h); usable where bodies run. All lengths are edge
// lengths.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "base/array_view.h"
#include "base/counter_rng.h"
#include "base/platform.h"
#include "fields/point_rows.h"
#include "input/hull_view.h"
#include "input/surface_tensor.h"

namespace amhex {

// A triangle that the hull's hierarchy leaves out, being without area.
struct FlatTriangle {
  int32_t number = 0;
  HullTriangle corners;
  Vec3d normal;  // a neighbour's
};

// The hull's triangles, and points along its sharp edges. Views do not own.
struct SampledSurface {
  HullView hull;
  ArrayView<const FlatTriangle> flat;          // all that are not in there
  ArrayView<const int32_t> place;              // [triangle] in the hull, or -1 - place in `flat`
  ArrayView<const int32_t> patch;              // [triangle]
  ArrayView<const SymmetricTensor> curvature;  // [triangle]
  ArrayView<const int32_t> first_candidate;    // [triangle], and one more: how many there are
  ArrayView<const Vec3d> sharp_position;       // points that stand for sharp edges
  ArrayView<const Vec3d> sharp_direction;      // of the edge, unit
  ArrayView<const std::array<int32_t, 2>> sharp_patches;  // that it parts

  int64_t triangle_count() const { return patch.size; }
  AMHEX_HD const HullTriangle& Corners(int64_t triangle) const {
    const int32_t at = place[triangle];
    return at >= 0 ? hull.triangles[at] : flat[-1 - at].corners;
  }
  AMHEX_HD const Vec3d& Normal(int64_t triangle) const {
    const int32_t at = place[triangle];
    return at >= 0 ? hull.normals[at] : flat[-1 - at].normal;
  }
  // Those that the host has: places follow from the hull, which has its own copy.
  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(flat), visit(patch), visit(curvature), visit(first_candidate);
    visit(sharp_position), visit(sharp_direction), visit(sharp_patches);
  }
};

// One element per triangle of the hierarchy, and one per flat one.
struct PlaceInHullBody {
  ArrayView<const int32_t> original;
  ArrayView<int32_t> place;
  AMHEX_HD void operator()(int64_t i) const { place[original[i]] = static_cast<int32_t>(i); }
};
struct PlaceFlatBody {
  ArrayView<const FlatTriangle> flat;
  ArrayView<int32_t> place;
  AMHEX_HD void operator()(int64_t i) const {
    place[flat[i].number] = -1 - static_cast<int32_t>(i);
  }
};

// One of the places where samples may be.
struct SampleCandidate {
  Vec3d position;
  int32_t triangle = 0;
};

struct HullSample {
  Vec3d position, normal, tangent;
  float confidence = 0;
};

// Samples belong to the hull alone: they are the same for every seed of a run.
inline constexpr uint64_t kSampleSeed = 0;
inline constexpr double kSampleDistance = 0.45;  // no two of one side are nearer
// Bins of the candidates, and of the points along sharp edges.
inline constexpr double kCandidateBinSize = 0.5;

// The serial number decides where in its triangle it lies.
AMHEX_HD inline SampleCandidate CandidateOf(const SampledSurface& surface, int64_t serial) {
  int64_t begin = 0, end = surface.patch.size;  // the last whose first is no later
  while (end - begin > 1) {
    const int64_t middle = (begin + end) / 2;
    if (surface.first_candidate[middle] <= serial) {
      begin = middle;
    } else {
      end = middle;
    }
  }
  const HullTriangle& corners = surface.Corners(begin);
  const auto index = static_cast<uint64_t>(serial);
  const double root = std::sqrt(RandomUnit(kSampleSeed, RandomStream::kSampleAcross, index));
  const double split = RandomUnit(kSampleSeed, RandomStream::kSampleAlong, index);
  return {corners.a * (1 - root) + corners.b * (root * (1 - split)) + corners.c * (root * split),
          static_cast<int32_t>(begin)};
}
// Candidates have their turn by rising keys.
AMHEX_HD inline double TurnOfCandidate(int64_t serial) {
  return RandomUnit(kSampleSeed, RandomStream::kSampleOrder, static_cast<uint64_t>(serial));
}

// All candidates among each other.
struct CandidateView {
  SampledSurface surface;
  ArrayView<const Vec3d> position;    // [candidate]
  ArrayView<const int32_t> triangle;  // [candidate]
  fields::PointRowsView rows;         // of the positions
  fields::PointRowsView sharp_rows;   // of the points along sharp edges

  // Calls visit(j) for those that a sample at candidate i makes superfluous, itself among them.
  template <class Visit>
  AMHEX_HD void VisitCovered(int32_t i, const Visit& visit) const {
    VisitSameSide(i, kSampleDistance, [&](int32_t j, double) { visit(j); });
  }

  AMHEX_HD HullSample SampleAt(int32_t i) const {
    // Sum of curvatures at which confidence is halved.
    constexpr double kFlatCurvature = 0.05;
    HullSample sample{position[i], NormalOf(i), AlongSharpEdge(i), 1.0F};
    if (SquaredNorm(sample.tangent) > 0) return sample;
    const PrincipalDirections principal = PrincipalDirectionsOf(MeanCurvature(i), sample.normal);
    sample.tangent = principal.largest;
    const double sum = std::abs(principal.curvature_max) + std::abs(principal.curvature_min);
    const double difference = std::abs(principal.curvature_max - principal.curvature_min);
    const double confidence = sum > 0 ? difference / sum * (sum / (sum + kFlatCurvature)) : 0.0;
    sample.confidence = static_cast<float>(Smaller(1.0, confidence));
    return sample;
  }

 private:
  AMHEX_HD const Vec3d& NormalOf(int32_t i) const { return surface.Normal(triangle[i]); }
  AMHEX_HD int32_t PatchOf(int32_t i) const { return surface.patch[triangle[i]]; }

  // visit(j, squared distance) for candidates within `reach` that see the surface alike.
  template <class Visit>
  AMHEX_HD void VisitSameSide(int32_t i, double reach, const Visit& visit) const {
    // Opposite sides of a thin wall do not see each other.
    constexpr double kSameSideCosine = 0.3;
    rows.VisitNear(position[i], reach, [&](int32_t j) {
      const double squared = SquaredNorm(position[j] - position[i]);
      if (squared > reach * reach || PatchOf(i) != PatchOf(j)) return;
      if (Dot(NormalOf(i), NormalOf(j)) > kSameSideCosine) visit(j, squared);
    });
  }

  // Unit direction of the nearest sharp edge of the candidate's patch, in its plane; zero if none.
  AMHEX_HD Vec3d AlongSharpEdge(int32_t i) const {
    constexpr double kReach = 0.75;
    constexpr double kLeastInPlane = 0.5;  // of a unit vector
    const int32_t own = PatchOf(i);
    double best = kReach * kReach;
    int32_t nearest = -1;
    sharp_rows.VisitNear(position[i], kReach, [&](int32_t j) {
      const std::array<int32_t, 2>& patches = surface.sharp_patches[j];
      if (patches[0] != own && patches[1] != own) return;
      const double squared = SquaredNorm(surface.sharp_position[j] - position[i]);
      const bool is_nearer =
          nearest < 0 ? squared <= best : squared < best || (squared == best && j < nearest);
      if (is_nearer && Norm(InPlane(i, j)) > kLeastInPlane) best = squared, nearest = j;
    });
    return nearest < 0 ? Vec3d{} : Normalized(InPlane(i, nearest));
  }
  AMHEX_HD Vec3d InPlane(int32_t i, int32_t sharp) const {
    const Vec3d& direction = surface.sharp_direction[sharp];
    return direction - NormalOf(i) * Dot(direction, NormalOf(i));
  }

  AMHEX_HD SymmetricTensor MeanCurvature(int32_t i) const {
    constexpr double kReach = 1.0;
    SymmetricTensor sum;
    double weight_sum = 0;
    VisitSameSide(i, kReach, [&](int32_t j, double squared) {
      const double fade = 1 - squared / (kReach * kReach);
      sum.Add(surface.curvature[triangle[j]], fade);
      weight_sum += fade;
    });
    SymmetricTensor mean;
    if (weight_sum > 0) mean.Add(sum, 1 / weight_sum);
    return mean;
  }
};

}  // namespace amhex
