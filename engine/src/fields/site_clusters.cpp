#include "fields/site_clusters.h"

#include <oneapi/tbb/parallel_sort.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "base/array_view_of.h"
#include "base/status_macros.h"
#include "base/stop_poll.h"
#include "fields/cluster_input.h"
#include "fields/face_links.h"
#include "fields/point_index.h"

namespace amhex::fields {
namespace {

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

// What a node would found, were it chosen.
struct Cluster {
  Vec3d centre;
  bool is_well_inside = false;
  std::vector<int32_t> claimed;  // nodes, its own among them
};

// One choice after the other. What each of the next ones would found is asked side by side, of all
// that are not claimed yet; few of those are claimed by one another.
std::vector<ClusterSite> ChooseSites(const std::vector<HeavyNode>& heavy,
                                     const ClusterView& clusters, const ClusterInput& input,
                                     const RunContext& run, const StopPoll& poll) {
  constexpr size_t kAskedAtOnce = 4096;
  std::vector<uint8_t> is_claimed(static_cast<size_t>(input.nodes.count()), 0);
  std::vector<Cluster> asked(std::min(kAskedAtOnce, heavy.size()));
  std::vector<ClusterSite> sites;
  for (size_t begin = 0; begin < heavy.size(); begin += asked.size()) {
    const size_t count = std::min(asked.size(), heavy.size() - begin);
    ForEach(run, static_cast<int64_t>(count), [&](int64_t i) {
      const int32_t node = heavy[begin + i].node;
      if (is_claimed[node] != 0) return;
      Cluster& cluster = asked[i];
      cluster.centre = clusters.Centre(node);
      cluster.is_well_inside =
          clusters.IsWellInside(input.hull, node, input.nodes[node], cluster.centre);
      cluster.claimed.clear();
      if (!cluster.is_well_inside) return;
      clusters.VisitClaimed(node, cluster.centre, [&](int32_t j) { cluster.claimed.push_back(j); });
    });
    poll.Now();
    for (size_t i = 0; i < count; ++i) {
      const int32_t node = heavy[begin + i].node;
      if (is_claimed[node] != 0 || !asked[i].is_well_inside) continue;
      for (const int32_t j : asked[i].claimed) is_claimed[j] = 1;
      sites.push_back({node, asked[i].centre});
    }
  }
  return sites;
}

absl::StatusOr<std::vector<ClusterSite>> FindClusters(const PointIndex& index,
                                                      const ClusterInput& input,
                                                      const ProgressSlice& slice) {
  // Of a node that may found a cluster.
  constexpr auto kLeastMass = static_cast<float>(kMinMass);
  const RunContext& run = slice.run();
  const ClusterView clusters{input.lattice, index.view()};
  const int64_t count = input.nodes.count();
  std::vector<float> mass(static_cast<size_t>(count));
  ForEach(run, count, [&](int64_t i) { mass[i] = clusters.Mass(i); });
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  slice.Report(0.5);
  const StopPoll poll(run);
  try {
    return ChooseSites(HeavyNodes(mass, kLeastMass, poll), clusters, input, run, poll);
  } catch (const RunStopped&) {
    return run.CheckStop();
  }
}

Sites SitesOf(const std::vector<ClusterSite>& clusters, const LatticeForm& form) {
  Sites sites;
  for (const ClusterSite& site : clusters) {
    sites.position.push_back(site.centre);
    sites.frame.push_back(ToFrame(form.frames[site.node]));
    sites.size.push_back(form.sizes[site.node]);
    sites.cell_volume.push_back(0);
  }
  return sites;
}

}  // namespace

absl::StatusOr<Sites> ClusterSites(const HullQueries& hull, const BackgroundGrid& grid,
                                   const LatticeForm& form, const std::vector<Vec3d>& positions,
                                   const ProgressSlice& slice) {
  const ClusterInput input{
      {ArrayViewOf(form.frames), ArrayViewOf(form.sizes), ArrayViewOf(positions)},
      grid.Cells(),
      hull.view()};
  AMHEX_ASSIGN_OR_RETURN(const std::vector<ClusterSite> clusters,
                         FindClusters(PointIndex(positions, kClusterBinSize), input, slice));
  Sites sites = SitesOf(clusters, form);
  sites.links = LinksOf(VoteFaces(grid, form, positions, sites, slice.run()));
  AMHEX_RETURN_IF_ERROR(slice.run().CheckStop());
  slice.Report(1.0);
  return sites;
}

}  // namespace amhex::fields
