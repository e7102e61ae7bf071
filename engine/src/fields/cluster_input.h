// What the clustering of site_clusters.h is made of and finds, wherever it runs.
#pragma once

#include <cstdint>

#include "fields/cluster_view.h"
#include "fields/face_votes.h"
#include "fields/grid_keys.h"

namespace amhex::fields {

inline constexpr double kSiteBinSize = 1.0;  // edge lengths

struct ClusterSite {
  int64_t node = 0;  // that founded the cluster
  Vec3d centre;
};

struct ClusterInput {
  LatticeView lattice;
  CellCentres nodes;  // where the nodes are
  HullView hull;
};

}  // namespace amhex::fields
