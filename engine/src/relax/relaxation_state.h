// The numbers of a running relaxation, kept where its bodies run so that nobody waits for them.
#pragma once

#include <cstdint>

#include "base/array_view.h"

namespace amhex {

// Places in the state array.
inline constexpr int kSiteCount = 0;
inline constexpr int kIteration = 1;     // iterations done
inline constexpr int kClusterCount = 2;  // of this iteration; 0 once it is too late to split
inline constexpr int kMovement = 3;      // summed over kMovedCount sites, kMovementUnit
inline constexpr int kMovedCount = 4;
inline constexpr int kSplitCount = 5;  // since the start
inline constexpr int kStateSize = 6;

struct RelaxationState {
  ArrayView<int64_t> value;  // [kStateSize]

  AMHEX_HD int64_t SiteCount() const { return value[kSiteCount]; }
  AMHEX_HD int64_t Iteration() const { return value[kIteration]; }
  AMHEX_HD int64_t ClusterCount() const { return value[kClusterCount]; }
  AMHEX_HD void Set(int place, int64_t number) const { value[place] = number; }

  // One of the numbers as a view, for bodies that are told where to look.
  ArrayView<int64_t> At(int place) const { return {value.data + place, 1}; }
};

}  // namespace amhex
