// Networks of slits that are too large for one star: stars over parts of them, cut off from the
// rest by membranes.
#pragma once

#include <cstdint>
#include <limits>

#include "absl/container/flat_hash_map.h"
#include "amhex/run_context.h"
#include "closure/working_mesh.h"
#include "input/hull.h"

namespace amhex {

struct CarveLimits {
  double min_quality = 0.15;     // of the new cells
  double max_cost_per_face = 4;  // cells that one open face less may cost
  int depth = 4;                 // cells absorbed at most
};

// What rounds with the same limits tell each other.
struct CarveMemory {
  // Where a round found nothing: [half-face] the open faces around it then. Places that still look
  // the same are not searched again.
  absl::flat_hash_map<int, uint64_t> digests;
  int64_t part_count = 0;  // parts that all rounds have looked at: their cost
  // No round begins once so many have been.
  int64_t most_parts = std::numeric_limits<int64_t>::max();
};

// One round: the best star over a part of the network is found at every open face, and those that
// close most for the least are applied where they do not touch. Open faces become fewer with every
// star. Returns the number of stars; 0 if nothing helps, the memory's parts are used up or the run
// is to stop. Same result at any thread count.
int CarveCavities(const Hull& hull, const CarveLimits& limits, const RunContext& run,
                  CarveMemory* memory, WorkingMesh* mesh);

}  // namespace amhex
