// The clustering of site_clusters.h as plain arrays: what crosses the border to the CUDA library
// that is loaded at run time.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "exec/resident_slot.h"
#include "fields/cluster_view.h"
#include "fields/face_votes.h"
#include "fields/grid_keys.h"

namespace amhex::fields {

struct ClusterSite {
  int64_t node = 0;  // that founded the cluster
  Vec3d centre;
};

// Views are on host arrays that outlive the task.
struct ClusterTask {
  LatticeView lattice;
  RowShape rows;                            // of the positions
  RowShape site_rows;                       // of what lies among them
  ArrayView<const AxisRotation> rotations;  // kAxisRotations
  CellCentres nodes;                        // where the nodes are
  HullView hull;
  ResidentSlot* resident = nullptr;  // the hull's, never null
  float least_mass = 0;              // of a node that may found a cluster
  // Out, as they were unless it was done: the sites, by falling mass, and which faces of theirs
  // the edges of the grid want glued (face_links.h).
  std::vector<ClusterSite> sites;
  std::vector<VotedFaces> voted;
  std::function<bool()> should_stop;  // may be empty
};

}  // namespace amhex::fields
