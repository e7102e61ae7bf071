// Evens out what a rebuilt surface has where no sample of the cloud supports it.
#pragma once

#include "amhex/input_hull.h"
#include "base/stop_poll.h"
#include "input/cloud_samples.h"
#include "input/point_tree.h"

namespace amhex {

// Across an opening of a scan the surface is a guess: what the samples along its rim say goes on
// for a while, and the winding number spans the rest. Where the two meet, lips and grooves are left
// that are narrower than a cell and that nobody has measured. They are evened out up to about
// `edge_length` (all lengths in the samples' units), and the surface stays where samples are near:
// corners and edges between them as well, which openings alone are wider than. An opening whose
// evened surface would pass through another part is left as it was.
//
// `tree`: of the samples' positions; `spacing`: of the grid that `mesh`, a closed two-manifold, was
// extracted from. O(vertices log samples + moved vertices). Throws RunStopped when `poll` does.
void FairOpenings(const CloudSamples& samples, const PointTree& tree, double edge_length,
                  double spacing, TriangleMesh& mesh, const StopPoll& poll);

}  // namespace amhex
