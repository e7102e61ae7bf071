// Who is next to whom, as the solves of one grid and its codes share it on a device.
#pragma once

#include "exec/resident_slot.h"

namespace amhex::fields {

// Made by the first solve that needs them.
struct LinkCopies {
  ResidentSlot of_slots;  // of the size field and the lattice form
  ResidentSlot of_nodes;  // of the phase field
};

}  // namespace amhex::fields
