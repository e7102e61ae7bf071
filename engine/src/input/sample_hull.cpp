#include "input/sample_hull.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

#include "base/counter_rng.h"
#include "base/status_macros.h"
#include "input/curvature.h"
#include "input/point_tree.h"
#include "input/triangle_math.h"

namespace amhex {
namespace {

// All lengths are edge lengths.
constexpr double kCandidatesPerArea = 16;  // four times as many as samples that fit
constexpr double kSmallestDistance = 0.45;
constexpr double kCurvatureRadius = 1.0;
constexpr double kSharpEdgeReach = 0.75;
constexpr double kSharpEdgeStep = 0.1;   // between the points that stand for sharp edges
constexpr double kFlatCurvature = 0.05;  // sum of curvatures at which confidence is halved
// Opposite sides of a thin wall do not see each other.
constexpr double kSameSideCosine = 0.3;
constexpr int64_t kStopInterval = 4096;

// Samples belong to the hull alone: they are the same for every seed of a run.
constexpr uint64_t kSampleSeed = 0;

double UnitRandom(uint64_t index, RandomStream stream) {
  return RandomUnit(kSampleSeed, stream, index);
}

struct Candidates {
  std::vector<Vec3d> position;
  std::vector<int32_t> triangle;
};

// Points spread evenly by area: each triangle gets its whole share, rounded by accumulation.
Candidates SpreadCandidates(const Hull& hull) {
  Candidates candidates;
  double owed = 0.5;
  uint64_t serial = 0;
  for (size_t t = 0; t < hull.triangles.size(); ++t) {
    const auto& corners = hull.triangles[t];
    const Vec3d& a = hull.vertices[static_cast<size_t>(corners[0])];
    const Vec3d& b = hull.vertices[static_cast<size_t>(corners[1])];
    const Vec3d& c = hull.vertices[static_cast<size_t>(corners[2])];
    owed += Norm(DoubleAreaVector(a, b, c)) / 2 * kCandidatesPerArea;
    for (; owed >= 1; owed -= 1, ++serial) {
      const double root = std::sqrt(UnitRandom(serial, RandomStream::kSampleAcross)),
                   split = UnitRandom(serial, RandomStream::kSampleAlong);
      candidates.position.push_back(a * (1 - root) + b * (root * (1 - split)) + c * (root * split));
      candidates.triangle.push_back(static_cast<int32_t>(t));
    }
  }
  return candidates;
}

// What is decided for candidates that see the surface alike.
class Surroundings {
 public:
  Surroundings(const Hull& hull, const Candidates& candidates)
      : hull_(hull), candidates_(candidates) {}
  const Vec3d& NormalOf(int32_t candidate) const {
    return hull_.triangle_normals[static_cast<size_t>(TriangleOf(candidate))];
  }
  int32_t PatchOf(int32_t candidate) const {
    return hull_.patch[static_cast<size_t>(TriangleOf(candidate))];
  }
  bool SameSide(int32_t a, int32_t b) const {
    return PatchOf(a) == PatchOf(b) && Dot(NormalOf(a), NormalOf(b)) > kSameSideCosine;
  }
  int32_t TriangleOf(int32_t candidate) const {
    return candidates_.triangle[static_cast<size_t>(candidate)];
  }

 private:
  const Hull& hull_;
  const Candidates& candidates_;
};

// Greedy dart throwing over the candidates in random order: a maximal set with the smallest
// distance.
absl::StatusOr<std::vector<int32_t>> ChooseSamples(const Candidates& candidates,
                                                   const PointTree& tree,
                                                   const Surroundings& surroundings,
                                                   RunContext& run) {
  const auto count = static_cast<int32_t>(candidates.position.size());
  std::vector<std::pair<double, int32_t>> order;
  for (int32_t i = 0; i < count; ++i) {
    order.emplace_back(UnitRandom(static_cast<uint64_t>(i), RandomStream::kSampleOrder), i);
  }
  std::sort(order.begin(), order.end());
  std::vector<uint8_t> covered(static_cast<size_t>(count), 0);
  std::vector<PointTree::Neighbour> near;
  std::vector<int32_t> chosen;
  for (const auto& [key, candidate] : order) {
    if (covered[static_cast<size_t>(candidate)] != 0) continue;
    if (static_cast<int64_t>(chosen.size()) % kStopInterval == 0) {
      AMHEX_RETURN_IF_ERROR(run.CheckStop());
    }
    chosen.push_back(candidate);
    tree.Within(candidates.position[static_cast<size_t>(candidate)], kSmallestDistance, near);
    for (const auto& neighbour : near) {
      if (surroundings.SameSide(candidate, neighbour.index)) {
        covered[static_cast<size_t>(neighbour.index)] = 1;
      }
    }
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

// Points along the sharp edges with the edge's direction and the two patches it parts.
struct SharpPoints {
  std::vector<Vec3d> position;
  std::vector<Vec3d> direction;
  std::vector<std::pair<int32_t, int32_t>> patches;
};

SharpPoints SpreadOverSharpEdges(const Hull& hull) {
  SharpPoints points;
  for (const SharpEdge& edge : hull.sharp_edges) {
    const Vec3d& a = hull.vertices[static_cast<size_t>(edge.vertex_a)];
    const Vec3d& b = hull.vertices[static_cast<size_t>(edge.vertex_b)];
    const int steps = std::max(1, static_cast<int>(std::ceil(Norm(b - a) / kSharpEdgeStep)));
    for (int i = 0; i < steps; ++i) {
      points.position.push_back(a + (b - a) * ((i + 0.5) / steps));
      points.direction.push_back(Normalized(b - a));
      points.patches.emplace_back(hull.patch[static_cast<size_t>(edge.triangle_left)],
                                  hull.patch[static_cast<size_t>(edge.triangle_right)]);
    }
  }
  return points;
}

class FrameFinder {
 public:
  FrameFinder(const Hull& hull, const Candidates& candidates, const PointTree& tree,
              const Surroundings& surroundings, const StopPoll& poll)
      : candidates_(candidates),
        tree_(tree),
        surroundings_(surroundings),
        curvatures_(TriangleCurvatures(hull, poll)),
        sharp_(SpreadOverSharpEdges(hull)),
        sharp_tree_(sharp_.position) {}

  // Tangent and confidence of the candidate's frame.
  std::pair<Vec3d, float> Find(int32_t candidate) const {
    const Vec3d& normal = surroundings_.NormalOf(candidate);
    const Vec3d along = AlongSharpEdge(candidate);
    if (SquaredNorm(along) > 0) return {along, 1.0f};

    const PrincipalDirections principal =
        PrincipalDirectionsOf(MeanCurvatureTensor(candidate), normal);
    const double sum = std::abs(principal.curvature_max) + std::abs(principal.curvature_min);
    if (!(sum > 0)) return {principal.largest, 0.0f};
    const double difference = std::abs(principal.curvature_max - principal.curvature_min);
    const double confidence = difference / sum * (sum / (sum + kFlatCurvature));
    return {principal.largest, static_cast<float>(std::min(1.0, confidence))};
  }

 private:
  // Unit direction of the nearest sharp edge of the candidate's patch, in its plane; zero if none.
  Vec3d AlongSharpEdge(int32_t candidate) const {
    const int32_t patch = surroundings_.PatchOf(candidate);
    const Vec3d& normal = surroundings_.NormalOf(candidate);
    std::vector<PointTree::Neighbour> near;
    sharp_tree_.Within(candidates_.position[static_cast<size_t>(candidate)], kSharpEdgeReach, near);
    std::sort(near.begin(), near.end());
    for (const auto& neighbour : near) {
      const auto i = static_cast<size_t>(neighbour.index);
      if (sharp_.patches[i].first != patch && sharp_.patches[i].second != patch) continue;
      const Vec3d& direction = sharp_.direction[i];
      const Vec3d in_plane = direction - normal * Dot(direction, normal);
      if (Norm(in_plane) > 0.5) return Normalized(in_plane);
    }
    return {};
  }

  SymmetricTensor MeanCurvatureTensor(int32_t candidate) const {
    std::vector<PointTree::Neighbour> near;
    tree_.Within(candidates_.position[static_cast<size_t>(candidate)], kCurvatureRadius, near);
    SymmetricTensor sum;
    double weight_sum = 0;
    for (const auto& neighbour : near) {
      if (!surroundings_.SameSide(candidate, neighbour.index)) continue;
      const double fade = 1 - neighbour.squared_distance / (kCurvatureRadius * kCurvatureRadius);
      sum.Add(curvatures_[static_cast<size_t>(surroundings_.TriangleOf(neighbour.index))], fade);
      weight_sum += fade;
    }
    SymmetricTensor mean;
    if (weight_sum > 0) mean.Add(sum, 1 / weight_sum);
    return mean;
  }

  const Candidates& candidates_;
  const PointTree& tree_;
  const Surroundings& surroundings_;
  const std::vector<SymmetricTensor> curvatures_;
  const SharpPoints sharp_;
  const PointTree sharp_tree_;
};

}  // namespace

absl::StatusOr<HullSamples> SampleHull(const Hull& hull, const InputParams& /*params*/,
                                       RunContext& run) {
  const Candidates candidates = SpreadCandidates(hull);
  const PointTree tree(candidates.position);
  const Surroundings surroundings(hull, candidates);
  AMHEX_ASSIGN_OR_RETURN(const std::vector<int32_t> chosen,
                         ChooseSamples(candidates, tree, surroundings, run));

  const FrameFinder frames(hull, candidates, tree, surroundings, StopPoll(run));
  const size_t count = chosen.size();
  HullSamples samples;
  samples.position.resize(count), samples.normal.resize(count);
  samples.tangent.resize(count), samples.curvature_confidence.resize(count);
  tbb::parallel_for(size_t{0}, count, [&](size_t i) {
    if (run.ShouldStop()) return;
    const int32_t candidate = chosen[i];
    samples.position[i] = candidates.position[static_cast<size_t>(candidate)];
    samples.normal[i] = surroundings.NormalOf(candidate);
    std::tie(samples.tangent[i], samples.curvature_confidence[i]) = frames.Find(candidate);
  });
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  return samples;
}

}  // namespace amhex
