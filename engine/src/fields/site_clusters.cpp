#include "fields/site_clusters.h"

#include <oneapi/tbb/parallel_sort.h>

#include <utility>

#include "base/status_macros.h"
#include "base/stop_poll.h"
#include "cuda/device_use.h"
#include "fields/cluster_task.h"
#include "fields/point_index.h"

namespace amhex::fields {
namespace {

template <class T>
ArrayView<const T> ViewOf(const std::vector<T>& values) {
  return {values.data(), static_cast<int64_t>(values.size())};
}

struct HeavyNode {
  float mass;
  int32_t node;
};

// Nodes that may found a cluster, by falling mass; ties by index.
std::vector<HeavyNode> HeavyNodes(const std::vector<float>& mass, float least,
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

// One choice after the other.
absl::StatusOr<bool> ClusterOnCpu(const PointIndex& index, const ProgressSlice& slice,
                                  ClusterTask& task) {
  const RunContext& run = slice.run();
  const ClusterView clusters{task.lattice, index.view()};
  const int64_t count = task.nodes.count();
  std::vector<float> mass(static_cast<size_t>(count));
  ForEach(run, count, [&](int64_t i) { mass[i] = clusters.Mass(i); });
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  slice.Report(0.5);

  const StopPoll poll(run);
  std::vector<uint8_t> is_claimed(static_cast<size_t>(count), 0);
  std::vector<ClusterSite> sites;
  int64_t visited = 0;
  for (const HeavyNode& heavy : HeavyNodes(mass, task.least_mass, poll)) {
    poll.At(++visited);
    const int32_t node = heavy.node;
    if (is_claimed[node] != 0) continue;
    const Vec3d centre = clusters.Centre(node);
    if (!clusters.IsWellInside(task.hull, node, task.nodes[node], centre)) continue;
    clusters.VisitClaimed(node, centre, [&](int32_t j) { is_claimed[j] = 1; });
    sites.push_back({node, centre});
  }
  task.sites = std::move(sites);
  return true;
}

}  // namespace

absl::StatusOr<Sites> ClusterSites(const HullAsker& hull, const BackgroundGrid& grid,
                                   const LatticeForm& form, const std::vector<Vec3d>& positions,
                                   const ProgressSlice& slice) {
  constexpr double kFullMass = kNodesPerEdge * kNodesPerEdge * kNodesPerEdge;
  ClusterTask task{{ViewOf(form.frames), ViewOf(form.sizes), ViewOf(positions)},
                   ShapeOfRows(positions, kClusterBinSize),
                   CentresOf(grid.fine().key, grid.origin, grid.spacing),
                   hull.queries().view(),
                   &hull.queries().resident(),
                   static_cast<float>(kMinMassShare * kFullMass),
                   {},
                   [&slice] { return slice.run().ShouldStop(); }};
  const auto on_cpu = [&]() -> absl::StatusOr<bool> {
    try {
      return ClusterOnCpu(PointIndex(positions, kClusterBinSize), slice, task);
    } catch (const RunStopped&) {
      return slice.run().CheckStop();
    }
  };
  AMHEX_RETURN_IF_ERROR(RunWhereChosen(hull.device(), &task, on_cpu).status());
  AMHEX_RETURN_IF_ERROR(slice.run().CheckStop());
  Sites sites;
  for (const ClusterSite& site : task.sites) {
    sites.position.push_back(site.centre);
    sites.frame.push_back(ToFrame(form.frames[site.node]));
    sites.size.push_back(form.sizes[site.node]);
    sites.cell_volume.push_back(0);
  }
  slice.Report(1.0);
  return sites;
}

}  // namespace amhex::fields
