// A placement once more, to find out on what a step would do to it.
#pragma once

#include "optimize/placement.h"

namespace amhex {

struct PlacementCopy {
  explicit PlacementCopy(const Placement& original)
      : complex(original.complex),
        placement{complex, original.features, original.neighbourhoods, original.constraints,
                  original.survey} {}
  PlacementCopy(const PlacementCopy&) = delete;
  PlacementCopy& operator=(const PlacementCopy&) = delete;

  CellComplex complex;
  Placement placement;  // of it
};

}  // namespace amhex
