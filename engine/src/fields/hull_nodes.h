// The nodes next to the hull and what it demands of them, as plain arrays; usable where bodies run.
#pragma once

#include <cstdint>

#include "base/array_view.h"
#include "exec/resident_slot.h"
#include "fields/hull_constraint.h"

namespace amhex::fields {

// Views do not own.
struct HullNodes {
  ArrayView<const int32_t> nodes;  // rising
  ArrayView<const int32_t> first;  // [place among them] of its constraints, and how many there are
  ArrayView<const HullConstraint> constraints;
  ResidentSlot* resident = nullptr;  // null: copied for every task

  int64_t count() const { return nodes.size; }
  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(nodes), visit(first), visit(constraints);
  }
};

}  // namespace amhex::fields
