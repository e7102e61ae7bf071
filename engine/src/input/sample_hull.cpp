#include "input/sample_hull.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/array_view_of.h"
#include "base/status_macros.h"
#include "cuda/device_use.h"
#include "exec/cpu_executor.h"
#include "fields/point_index.h"
#include "input/curvature.h"
#include "input/hull_queries.h"
#include "input/sample_task.h"
#include "input/triangle_math.h"

namespace amhex {
namespace {

// All lengths are edge lengths.
constexpr double kCandidatesPerArea = 16;  // four times as many as samples that fit
constexpr double kSharpEdgeStep = 0.1;     // between the points that stand for sharp edges
// Candidates may leave their triangle, and the hull's box, by rounding.
constexpr double kBoxMargin = 1e-3;
// On a device, fewer candidates cost more than they save (a guess, as for hull queries).
constexpr int64_t kFewestForDevice = 2048;

// Points spread evenly by area: each triangle gets its whole share, rounded by accumulation.
// [triangle] its first candidate; at the end how many there are.
absl::StatusOr<std::vector<int32_t>> FirstCandidates(const Hull& hull, const StopPoll& poll) {
  std::vector<int32_t> first;
  double owed = 0.5;
  for (size_t t = 0; t < hull.triangles.size(); ++t) {
    poll.At(static_cast<int64_t>(t));
    first.push_back(static_cast<int32_t>(owed));
    const auto& corners = hull.triangles[t];
    owed += Norm(DoubleAreaVector(hull.vertices[static_cast<size_t>(corners[0])],
                                  hull.vertices[static_cast<size_t>(corners[1])],
                                  hull.vertices[static_cast<size_t>(corners[2])])) /
            2 * kCandidatesPerArea;
    constexpr double kMost = std::numeric_limits<int32_t>::max();
    if (owed >= kMost) {
      return absl::ResourceExhaustedError(absl::StrCat("the hull has more than ", kMost,
                                                       " places for samples; ask for fewer cells"));
    }
  }
  first.push_back(static_cast<int32_t>(owed));
  return first;
}

// Points along the sharp edges with the edge's direction and the two patches it parts.
struct SharpPoints {
  std::vector<Vec3d> position;
  std::vector<Vec3d> direction;
  std::vector<std::array<int32_t, 2>> patches;
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
      points.patches.push_back({hull.patch[static_cast<size_t>(edge.triangle_left)],
                                hull.patch[static_cast<size_t>(edge.triangle_right)]});
    }
  }
  return points;
}

// Greedy dart throwing over the candidates in random order: a maximal set with the smallest
// distance. Ascending.
std::vector<int32_t> ChooseSamples(const CandidateView& candidates, const StopPoll& poll) {
  std::vector<std::pair<double, int32_t>> order;
  for (int64_t i = 0; i < candidates.position.size; ++i) {
    order.emplace_back(TurnOfCandidate(i), static_cast<int32_t>(i));
  }
  std::sort(order.begin(), order.end());
  std::vector<uint8_t> covered(order.size(), 0);
  std::vector<int32_t> chosen;
  for (const auto& [key, candidate] : order) {
    if (covered[static_cast<size_t>(candidate)] != 0) continue;
    poll.At(static_cast<int64_t>(chosen.size()));
    chosen.push_back(candidate);
    candidates.VisitCovered(candidate,
                            [&covered](int32_t j) { covered[static_cast<size_t>(j)] = 1; });
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

// What the hierarchy leaves out, by the same rule.
std::vector<FlatTriangle> FlatTriangles(const Hull& hull, const StopPoll& poll) {
  std::vector<FlatTriangle> flat;
  for (size_t t = 0; t < hull.triangles.size(); ++t) {
    poll.At(static_cast<int64_t>(t));
    const auto& corners = hull.triangles[t];
    const HullTriangle triangle{hull.vertices[static_cast<size_t>(corners[0])],
                                hull.vertices[static_cast<size_t>(corners[1])],
                                hull.vertices[static_cast<size_t>(corners[2])]};
    if (!IsDegenerate(triangle.a, triangle.b, triangle.c)) continue;
    flat.push_back({static_cast<int32_t>(t), triangle, hull.triangle_normals[t]});
  }
  return flat;
}

std::vector<int32_t> PlacesOnCpu(CpuExecutor& executor, const SampledSurface& surface) {
  std::vector<int32_t> places(static_cast<size_t>(surface.triangle_count()));
  const ArrayView<int32_t> place{places.data(), surface.triangle_count()};
  executor.ForEach("place triangles", surface.hull.original.size,
                   PlaceInHullBody{surface.hull.original, place});
  executor.ForEach("place flat triangles", surface.flat.size, PlaceFlatBody{surface.flat, place});
  return places;
}

// False if it was stopped.
bool SampleOnCpu(SampleTask& task, const StopPoll& poll) {
  CpuExecutor executor(task.should_stop);
  const std::vector<int32_t> places = PlacesOnCpu(executor, task.surface);
  if (executor.Stopped()) return false;
  task.surface.place = ArrayViewOf(places);
  const auto count = static_cast<size_t>(task.candidate_count);
  std::vector<Vec3d> position(count);
  std::vector<int32_t> triangle(count);
  executor.ForEach("spread candidates", task.candidate_count, [&](int64_t i) {
    const SampleCandidate candidate = CandidateOf(task.surface, i);
    position[static_cast<size_t>(i)] = candidate.position;
    triangle[static_cast<size_t>(i)] = candidate.triangle;
  });
  if (executor.Stopped()) return false;
  const ArrayView<const Vec3d> sharp = task.surface.sharp_position;
  const fields::PointIndex rows(position, task.rows);
  const fields::PointIndex sharp_rows({sharp.data, sharp.data + sharp.size}, task.sharp_rows);
  const CandidateView view{task.surface, ArrayViewOf(position), ArrayViewOf(triangle), rows.view(),
                           sharp_rows.view()};
  const std::vector<int32_t> chosen = ChooseSamples(view, poll);
  std::vector<HullSample> samples(chosen.size());
  executor.ForEach("find the samples' frames", static_cast<int64_t>(chosen.size()), [&](int64_t k) {
    samples[static_cast<size_t>(k)] = view.SampleAt(chosen[static_cast<size_t>(k)]);
  });
  if (executor.Stopped()) return false;
  task.samples = std::move(samples);
  return true;
}

HullSamples Unpacked(const std::vector<HullSample>& samples) {
  HullSamples unpacked;
  for (const HullSample& sample : samples) {
    unpacked.position.push_back(sample.position);
    unpacked.normal.push_back(sample.normal);
    unpacked.tangent.push_back(sample.tangent);
    unpacked.curvature_confidence.push_back(sample.confidence);
  }
  return unpacked;
}

Box3d Grown(Box3d box) {
  const Vec3d margin{kBoxMargin, kBoxMargin, kBoxMargin};
  box.low -= margin, box.high += margin;
  return box;
}

}  // namespace

absl::StatusOr<HullSamples> SampleHull(const Hull& hull, Backend backend, RunContext& run) {
  AMHEX_ASSIGN_OR_RETURN(DeviceUse device, DeviceUse::Choose(backend));
  const StopPoll poll(run);
  AMHEX_ASSIGN_OR_RETURN(const std::vector<int32_t> first, FirstCandidates(hull, poll));
  const std::vector<SymmetricTensor> curvature = TriangleCurvatures(hull, poll);
  const SharpPoints sharp = SpreadOverSharpEdges(hull);
  const Box3d box = Grown(hull.box);
  const std::vector<FlatTriangle> flat = FlatTriangles(hull, poll);
  const int64_t count = first.back();
  const auto sharp_count = static_cast<int64_t>(sharp.position.size());
  SampleTask task{{hull.queries->view_if_here(),
                   ArrayViewOf(flat),
                   {},
                   ArrayViewOf(hull.patch),
                   ArrayViewOf(curvature),
                   ArrayViewOf(first),
                   ArrayViewOf(sharp.position),
                   ArrayViewOf(sharp.direction),
                   ArrayViewOf(sharp.patches)},
                  &hull.queries->resident(),
                  count,
                  fields::ShapeOfRows(box, count, kCandidateBinSize),
                  fields::ShapeOfRows(box, sharp_count, kCandidateBinSize),
                  {},
                  [&run] { return run.ShouldStop(); }};
  const auto on_cpu = [&] {
    task.surface.hull = hull.queries->view();
    return SampleOnCpu(task, poll);
  };
  const bool is_small = count < kFewestForDevice && hull.queries->is_here();
  DeviceUse* const where = is_small ? nullptr : &device;
  AMHEX_RETURN_IF_ERROR(RunWhereChosen(where, &task, on_cpu).status());
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  HullSamples samples = Unpacked(task.samples);
  samples.device_notes = device.notes();
  return samples;
}

}  // namespace amhex
