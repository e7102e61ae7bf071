#include "input/embedding_check.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "input/query_cost.h"
#include "input/triangle_math.h"

namespace amhex {
namespace {

constexpr size_t kMostProbes = 20'000;
// Fewer probes where each of them is dear, so that all together look at no more than so many nodes
// and triangles; but so many always.
constexpr double kMostSteps = 1e8;
constexpr size_t kFewestProbes = 200;
// Distance of the probes from the triangle, in square roots of its area: near enough to stay
// between sheets that nearly touch, far enough for doubles.
constexpr double kProbeRatio = 1e-3;
// Winding numbers of probes may be off by this much.
constexpr double kTolerance = 0.3;

size_t ProbeCount(const HullQueries& queries) {
  const double steps_per_probe = 2 * std::max(1.0, MeanWindingSteps(queries.view()));
  return std::max(kFewestProbes, static_cast<size_t>(std::min(static_cast<double>(kMostProbes),
                                                              kMostSteps / steps_per_probe)));
}

}  // namespace

double MisboundedAreaRatio(const TriangleMesh& mesh, const HullQueries& queries,
                           const StopPoll& poll) {
  const size_t step = std::max<size_t>(1, mesh.triangles.size() / ProbeCount(queries));
  const size_t probe_count = (mesh.triangles.size() + step - 1) / step;
  std::vector<double> area(probe_count, 0), wrong(probe_count, 0);
  tbb::parallel_for(size_t{0}, probe_count, [&](size_t i) {
    poll.Now();
    const auto& t = mesh.triangles[i * step];
    const Vec3d& a = mesh.vertices[static_cast<size_t>(t[0])];
    const Vec3d& b = mesh.vertices[static_cast<size_t>(t[1])];
    const Vec3d& c = mesh.vertices[static_cast<size_t>(t[2])];
    if (IsDegenerate(a, b, c)) return;
    const Vec3d area_vector = DoubleAreaVector(a, b, c);
    area[i] = Norm(area_vector) / 2;
    const Vec3d offset = Normalized(area_vector) * (kProbeRatio * std::sqrt(area[i]));
    const Vec3d centre = (a + b + c) / 3.0;
    const double outside = queries.WindingNumber(centre + offset);
    const double inside = queries.WindingNumber(centre - offset);
    if (std::abs(outside) > kTolerance || std::abs(inside - 1) > kTolerance) wrong[i] = area[i];
  });
  double total = 0, total_wrong = 0;
  for (size_t i = 0; i < probe_count; ++i) total += area[i], total_wrong += wrong[i];
  return total > 0 ? total_wrong / total : 0;
}

}  // namespace amhex
