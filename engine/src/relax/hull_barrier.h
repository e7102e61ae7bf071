// Which side of the hull every lattice point lies on: "the mesh also acts as a natural boundary"
// (section 4.1, "Input Hull"). Computed once; the lattice does not move.
#pragma once

#include <cstdint>
#include <vector>

#include "amhex/vec3.h"
#include "relax/barrier_view.h"

namespace amhex {

// The domain frame of the relaxation: normalised coordinates minus `origin`, all positive.
struct HullBarrier {
  Vec3d origin;  // edge lengths, normalised frame
  Vec3d extent;  // edge lengths
  FccLattice lattice;
  std::vector<int32_t> tile_side;     // [tile_count] kTileInside, kTileOutside or a mask index
  std::vector<uint32_t> inside_mask;  // [mixed_tile_count][8]

  BarrierView View() const {
    return {lattice,
            {tile_side.data(), static_cast<int64_t>(tile_side.size())},
            {inside_mask.data(), static_cast<int64_t>(inside_mask.size())}};
  }
};

}  // namespace amhex
