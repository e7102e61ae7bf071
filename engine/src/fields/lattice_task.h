// From a closed lattice form to sites, as plain arrays: what crosses the border to the CUDA library
// that is loaded at run time.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "exec/resident_slot.h"
#include "fields/face_votes.h"
#include "fields/form_bodies.h"
#include "fields/grid_keys.h"
#include "fields/hull_nodes.h"
#include "fields/phase_course.h"
#include "input/hull_view.h"

namespace amhex::fields {

// Copies that earlier tasks may have made and later ones will use, each of one array as a view;
// none is null.
struct FormSlots {
  ResidentSlot* frames = nullptr;      // expected ones
  ResidentSlot* sizes = nullptr;       // likewise
  ResidentSlot* increments = nullptr;  // closed ones
};

struct LatticeSite {
  Vec3d centre;
  Quaternion frame;
  Vec3d size;
};

// Views are on host arrays that outlive the task.
struct LatticeTask {
  CellCentres nodes;                        // of the grid; its slot is not null
  NodeLinks links;                          // of which the neighbours are found there
  ResidentSlot* links_there = nullptr;      // never null
  ArrayView<const AxisRotation> rotations;  // kAxisRotations
  ExpectedView expected;
  HullNodes at_hull;
  ArrayView<const float> closed;  // increments, [node][d][axis]
  FormSlots form_there;
  double density = 1;  // of the form, cells per edge length cubed
  double denser = 1;   // than that this lattice is to be so many times
  PhaseCourse course;
  HullView hull;
  ResidentSlot* resident = nullptr;  // the hull's, never null
  // Out, as they were unless it was done: the sites, by falling mass, and which faces of theirs the
  // edges of the grid want glued (face_links.h).
  std::vector<LatticeSite> sites;
  std::vector<VotedFaces> voted;
  std::function<bool()> should_stop;  // may be empty
};

}  // namespace amhex::fields
