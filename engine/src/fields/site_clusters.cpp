#include "fields/site_clusters.h"

#include <oneapi/tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>

#include "base/stop_poll.h"
#include "fields/point_index.h"
#include "input/hull_queries.h"

namespace amhex::fields {
namespace {

// Radius of the kernel within which nodes agree, in cells.
constexpr double kKernelRadius = 0.3;
// A cluster needs this share of the mass that all nodes of a cell give together.
constexpr double kMinMassShare = 0.12;
// No two sites within this distance, in cells (maximum norm).
constexpr double kSuppression = 0.6;
// Sites nearer to the hull than this share of their smallest extent are the layer outside.
constexpr double kMinDepth = 0.2;
constexpr double kBinSize = 0.5;  // edge lengths
// Greedy choices between two polls of ShouldStop.
constexpr int64_t kPollInterval = 4096;

double Largest(const Vec3d& v) { return std::max({v.x, v.y, v.z}); }
double Smallest(const Vec3d& v) { return std::min({v.x, v.y, v.z}); }
double MaxNorm(const Vec3d& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

class Clusters {
 public:
  Clusters(const LatticeForm& form, const std::vector<Vec3d>& positions)
      : form_(form), positions_(positions), index_(positions, kBinSize) {}

  // Kernel mass around a node's position, relative to what a cell of its size would hold.
  float Mass(int64_t node) const {
    const AxisFrame frame = ToFrame(form_.frames[node]);
    const Vec3d& size = form_.sizes[node];
    double mass = 0;
    VisitKernel(node, frame, size, [&](int32_t, double r) { mass += 1 - r / kKernelRadius; });
    return static_cast<float>(mass / (size.x * size.y * size.z));
  }

  Vec3d Centre(int64_t node) const {
    Vec3d sum;
    int count = 0;
    VisitKernel(node, ToFrame(form_.frames[node]), form_.sizes[node], [&](int32_t j, double) {
      sum += positions_[j];
      ++count;
    });
    return sum / count;
  }

  // All nodes whose position a cell at `centre` claims.
  template <class Visit>
  void VisitClaimed(int64_t node, const Vec3d& centre, const Visit& visit) const {
    const AxisFrame frame = ToFrame(form_.frames[node]);
    const Vec3d& size = form_.sizes[node];
    const double reach = kSuppression * Largest(size) * std::sqrt(3.0);
    index_.VisitNear(centre, reach, [&](int32_t j) {
      if (MaxNorm(InCells(frame, size, positions_[j] - centre)) < kSuppression) visit(j);
    });
  }

 private:
  // visit(j, distance in cells) for all positions in the kernel, the node's own among them.
  template <class Visit>
  void VisitKernel(int64_t node, const AxisFrame& frame, const Vec3d& size,
                   const Visit& visit) const {
    const Vec3d& centre = positions_[node];
    index_.VisitNear(centre, kKernelRadius * Largest(size), [&](int32_t j) {
      const double r = Norm(InCells(frame, size, positions_[j] - centre));
      if (r < kKernelRadius) visit(j, r);
    });
  }

  const LatticeForm& form_;
  const std::vector<Vec3d>& positions_;
  PointIndex index_;
};

struct HeavyNode {
  float mass;
  int32_t node;
};

// Nodes that may found a cluster, by falling mass; ties by index.
std::vector<HeavyNode> HeavyNodes(const std::vector<float>& mass, double least,
                                  const StopPoll& poll) {
  std::vector<HeavyNode> heavy;
  for (size_t i = 0; i < mass.size(); ++i) {
    if (mass[i] >= least) heavy.push_back({mass[i], static_cast<int32_t>(i)});
  }
  poll.Now();
  oneapi::tbb::parallel_sort(heavy.begin(), heavy.end(),
                             [](const HeavyNode& a, const HeavyNode& b) {
                               return a.mass != b.mass ? a.mass > b.mass : a.node < b.node;
                             });
  poll.Now();
  return heavy;
}

// `node`: a place nearby that is inside.
bool IsWellInside(const HullQueries& queries, const Vec3d& node, const Vec3d& centre,
                  const Vec3d& size) {
  const double depth = kMinDepth * Smallest(size);
  // Where no hull comes between, both are on the same side, which is far cheaper to know.
  constexpr double kSlack = 1.01;
  const double reach = std::max(depth, kSlack * Norm(centre - node));
  if (!queries.IsWithin(centre, reach)) return true;
  return !queries.IsWithin(centre, depth) && queries.IsInside(centre);
}

}  // namespace

absl::StatusOr<Sites> ClusterSites(const Hull& hull, const BackgroundGrid& grid,
                                   const LatticeForm& form, const std::vector<Vec3d>& positions,
                                   const ProgressSlice& slice) {
  const RunContext& run = slice.run();
  const Clusters clusters(form, positions);
  std::vector<float> mass(grid.count());
  ForEach(run, grid.count(), [&](int64_t i) { mass[i] = clusters.Mass(i); });
  if (absl::Status status = run.CheckStop(); !status.ok()) return status;
  slice.Report(0.5);

  constexpr double kFullMass = kNodesPerEdge * kNodesPerEdge * kNodesPerEdge;
  Sites sites;
  std::vector<uint8_t> is_claimed(grid.count(), 0);
  int64_t visited = 0;
  for (const HeavyNode& heavy : HeavyNodes(mass, kMinMassShare * kFullMass, StopPoll(run))) {
    if (++visited % kPollInterval == 0) {
      if (absl::Status status = run.CheckStop(); !status.ok()) return status;
    }
    const int32_t node = heavy.node;
    if (is_claimed[node] != 0) continue;
    const Vec3d centre = clusters.Centre(node);
    if (!IsWellInside(*hull.queries, grid.Position(node), centre, form.sizes[node])) continue;
    clusters.VisitClaimed(node, centre, [&](int32_t j) { is_claimed[j] = 1; });
    is_claimed[node] = 1;
    sites.position.push_back(centre);
    sites.frame.push_back(ToFrame(form.frames[node]));
    sites.size.push_back(form.sizes[node]);
    sites.cell_volume.push_back(0);
  }
  slice.Report(1.0);
  return sites;
}

}  // namespace amhex::fields
