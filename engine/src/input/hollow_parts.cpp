#include "input/hollow_parts.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

#include "base/status_macros.h"
#include "base/stop_poll.h"
#include "input/estimate_normals.h"
#include "input/hull_queries.h"
#include "input/point_tree.h"

namespace amhex {
namespace {

// Samples of a part that are asked where they are, evenly spread over its list.
constexpr size_t kProbesPerPart = 64;
// Below so many of its samples, in their spacing, a closed part's winding number is looked at:
// nearer to it single discs show.
constexpr double kProbeDepth = 1.0;
// A part is closed if it winds around the places below so many of its samples: an opening may be
// below some, and at sharp edges estimated normals look anywhere.
constexpr double kClosedShare = 0.8;
constexpr double kInside = 0.5;  // winding number, as for the surface that is made of them
// No solid's winding number is below this, so that a sample whose normal leads there looks into
// what it bounds, unless there is solid on its other side.
constexpr double kInsideOut = -0.5;
// Samples asked before all are.
constexpr size_t kInsideOutProbes = 500;
// Neighbours that see each other within some 45 degrees of both their normals are the two sides of
// a wall; those of one surface have others beside them.
constexpr double kAboveCosine = 0.7;

int32_t RootOf(std::vector<int32_t>& parent, int32_t at) {
  while (parent[static_cast<size_t>(at)] != at) {
    const auto up = static_cast<size_t>(parent[static_cast<size_t>(at)]);
    parent[static_cast<size_t>(at)] = parent[up];
    at = parent[up];
  }
  return at;
}

bool AreSidesOfWall(const CloudSamples& samples, size_t a, size_t b) {
  const Vec3d along = Normalized(samples.position[b] - samples.position[a]);
  return std::min(std::abs(Dot(samples.normal[a], along)),
                  std::abs(Dot(samples.normal[b], along))) > kAboveCosine;
}

struct Part {
  std::vector<int32_t> samples;
  std::vector<Vec3d> probes;
  Box3d box;
  std::unique_ptr<HullQueries> discs;  // of closed parts only
};

// Samples that nearest neighbours connect, in order of their first ones.
absl::StatusOr<std::vector<Part>> FindParts(const CloudSamples& samples, const RunContext& run) {
  const PointTree tree(samples.position);
  const size_t count = samples.position.size();
  std::vector<std::vector<PointTree::Neighbour>> near(count);
  tbb::parallel_for(size_t{0}, count, [&](size_t i) {
    if (!run.ShouldStop()) tree.Nearest(samples.position[i], kLinkedNeighbours + 1, near[i]);
  });
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  std::vector<int32_t> parent(count);
  std::iota(parent.begin(), parent.end(), 0);
  for (size_t i = 0; i < count; ++i) {
    for (const PointTree::Neighbour& n : near[i]) {
      if (AreSidesOfWall(samples, i, static_cast<size_t>(n.index))) continue;
      const int32_t a = RootOf(parent, static_cast<int32_t>(i)), b = RootOf(parent, n.index);
      parent[static_cast<size_t>(std::max(a, b))] = std::min(a, b);
    }
  }
  std::vector<Part> parts;
  std::vector<size_t> part_of(count);
  for (size_t i = 0; i < count; ++i) {
    const auto root = static_cast<size_t>(RootOf(parent, static_cast<int32_t>(i)));
    if (root == i) {
      part_of[i] = parts.size();
      parts.emplace_back();
    }
    Part& part = parts[part_of[root]];
    part.samples.push_back(static_cast<int32_t>(i));
    part.box.Extend(samples.position[i]);
  }
  return parts;
}

// Its discs, if they bound a solid that the normals look out of.
void AddDiscs(const CloudSamples& samples, const StopPoll& poll, Part& part) {
  CloudSamples own;
  for (const int32_t i : part.samples) {
    const auto at = static_cast<size_t>(i);
    own.position.push_back(samples.position[at]);
    own.normal.push_back(samples.normal[at]);
    own.spacing.push_back(samples.spacing[at]);
  }
  const TriangleMesh soup = DiscSoup(own);
  auto discs = std::make_unique<HullQueries>(soup.vertices, soup.triangles, poll);
  const size_t step = (own.position.size() + kProbesPerPart - 1) / kProbesPerPart;
  size_t wound = 0;
  for (size_t i = 0; i < own.position.size(); i += step) {
    part.probes.push_back(own.position[i]);
    const Vec3d below = own.position[i] - own.normal[i] * (kProbeDepth * own.spacing[i]);
    wound += discs->WindingNumber(below) > kInside;
  }
  if (static_cast<double>(wound) >= kClosedShare * static_cast<double>(part.probes.size())) {
    part.discs = std::move(discs);
  }
}

bool LiesIn(const Part& inner, const Part& outer) {
  for (int axis = 0; axis < 3; ++axis) {
    if (inner.box.low[axis] < outer.box.low[axis]) return false;
    if (inner.box.high[axis] > outer.box.high[axis]) return false;
  }
  return std::all_of(inner.probes.begin(), inner.probes.end(),
                     [&](const Vec3d& p) { return outer.discs->WindingNumber(p) > kInside; });
}

bool LooksIntoItsSolid(const CloudSamples& samples, const HullQueries& discs, size_t i) {
  const Vec3d up = samples.normal[i] * (kProbeDepth * samples.spacing[i]);
  return discs.WindingNumber(samples.position[i] + up) < kInsideOut &&
         discs.WindingNumber(samples.position[i] - up) < kInside;
}

}  // namespace

absl::StatusOr<int64_t> TurnInsideOutSamples(RunContext& run, CloudSamples& samples) {
  const size_t count = samples.position.size();
  const TriangleMesh soup = DiscSoup(samples);
  const HullQueries discs(soup.vertices, soup.triangles, StopPoll(run));
  bool any = false;
  const size_t step = (count + kInsideOutProbes - 1) / kInsideOutProbes;
  for (size_t i = 0; i < count && !any; i += step) any = LooksIntoItsSolid(samples, discs, i);
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  if (!any) return 0;
  std::vector<uint8_t> turn(count, 0);
  tbb::parallel_for(size_t{0}, count, [&](size_t i) {
    if (!run.ShouldStop()) turn[i] = LooksIntoItsSolid(samples, discs, i);
  });
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  for (size_t i = 0; i < count; ++i) {
    if (turn[i] != 0) samples.normal[i] = -samples.normal[i];
  }
  return std::count(turn.begin(), turn.end(), 1);
}

absl::StatusOr<int64_t> HollowNestedParts(RunContext& run, CloudSamples& samples) {
  AMHEX_ASSIGN_OR_RETURN(std::vector<Part> parts, FindParts(samples, run));
  if (parts.size() <= 1) return 0;
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t c) {
    if (!run.ShouldStop()) AddDiscs(samples, StopPoll(run), parts[c]);
  });
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  std::erase_if(parts, [](const Part& part) { return part.discs == nullptr; });
  std::vector<uint8_t> is_hollow(parts.size(), 0);
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t c) {
    if (run.ShouldStop()) return;
    for (size_t other = 0; other < parts.size(); ++other) {
      if (other != c && LiesIn(parts[c], parts[other])) is_hollow[c] ^= 1;
    }
  });
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  int64_t turned = 0;
  for (size_t c = 0; c < parts.size(); ++c) {
    if (is_hollow[c] == 0) continue;
    ++turned;
    for (const int32_t i : parts[c].samples) {
      Vec3d& normal = samples.normal[static_cast<size_t>(i)];
      normal = -normal;
    }
  }
  return turned;
}

}  // namespace amhex
