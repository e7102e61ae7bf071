// Whether a lattice fits its solid, so that no other one is worth trying.
#pragma once

#include "base/stop_poll.h"
#include "input/hull.h"
#include "relax/sites.h"

namespace amhex::fields {

// Whether cubes at the sites, glued as their links say, would be hexahedra everywhere: every face
// has one partner, or none and then the hull next to it instead of another site; around every edge
// between glued cubes the lattice comes back to itself; and the hull is nowhere far from all sites,
// as it is where layers end before the tip of a wedge. Singular edges, around which other than four
// cubes lie inside, count as a misfit. O(sites + samples); most misfits are found soon. Throws
// RunStopped when `poll` does.
bool IsWholeLattice(const Sites& sites, const HullSamples& samples, const StopPoll& poll);

// The share of sites with a face whose partner has another one: there the lattice is torn.
// O(sites).
double ShareOfTornSites(const Sites& sites);

}  // namespace amhex::fields
