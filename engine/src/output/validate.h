// The law of an at-most-hexa mesh. Runs on every result; nothing that breaks it leaves the engine.
//
// Independent of the code that builds meshes: cell types, faces, volumes and Jacobians are derived
// anew (cell_law.h) from the 8-corner lists.
#pragma once

#include <cstdint>
#include <string>

#include "amhex/volume_mesh.h"
#include "base/stop_poll.h"
#include "output/boundary_overlap.h"
#include "output/boundary_topology.h"

namespace amhex {

class DeviceUse;

// Counts of everything examined; all counts of faults are zero for a valid mesh.
struct ValidationReport {
  int64_t cell_count = 0;
  int64_t vertex_count = 0;
  int64_t interior_face_count = 0;
  int64_t boundary_face_count = 0;
  double volume = 0;               // sum of the cells' volumes, user's units cubed
  double min_scaled_jacobian = 0;  // over all cells
  double min_volume = 0;
  double relative_min_map_jacobian = 0;  // worst cell: least sampled Jacobian / cell volume

  // Faults that make the rest meaningless; when one is found the examination ends there.
  int64_t array_size_mismatches = 0;  // types or quality not of the cells' length
  int64_t index_out_of_range_count = 0;
  int64_t non_finite_vertex_count = 0;

  // Faults of cells.
  int64_t unknown_cell_count = 0;   // no pattern of Figure 2
  int64_t wrong_type_count = 0;     // a known pattern, declared as another
  int64_t wrong_quality_count = 0;  // stated quality is not the minimum scaled Jacobian
  int64_t non_positive_volume_count = 0;
  int64_t non_positive_scaled_jacobian_count = 0;
  int64_t non_positive_map_jacobian_count = 0;
  int64_t duplicate_cell_count = 0;
  int64_t unused_vertex_count = 0;
  int64_t first_bad_cell = -1;  // the first cell of any of these faults; -1 = none

  // Faults of conformity.
  int64_t same_side_face_count = 0;  // shared by two cells on the same side
  int64_t overused_face_count = 0;   // of more than two cells
  BoundaryTopology boundary;

  // Faults of the embedding; measured only where the boundary is closed and manifold.
  OverlapReport overlap;
  double volume_mismatch = 0;  // |boundary's volume - cells' volume| / cells' volume

  bool valid() const;
  // True if places covered twice are the only faults, and there are such.
  bool OnlyOverlaps() const;
  // "valid: 8685 cells ..." or "invalid: " and every fault with its count, in one line.
  std::string Summary() const;
};

// Linear in the number of cells, plus the overlap test's sampled winding numbers, on `device`
// unless it is null. Throws RunStopped when `poll` does, StatusError when the device fails.
ValidationReport ValidateMesh(const AtMostHexaMesh& mesh, const StopPoll& poll = {},
                              DeviceUse* device = nullptr);

}  // namespace amhex
