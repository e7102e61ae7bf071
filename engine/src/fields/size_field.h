// The edge length along each axis of the frame field that makes the field integrable as far as
// possible.
//
// Where frames turn, cells of constant size cannot fit together: each layer would need another
// number of cells. For a frame field with axes f_a, the lengths exp(s_a) have to follow
// grad s_a = f_a x curl f_a across the axis.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "fields/background_grid.h"
#include "fields/link_copies.h"
#include "fields/orientation_field.h"

namespace amhex::fields {

struct SizeSettings {
  double min_size = 0.4;        // edge lengths
  double max_size = 2.5;        // edge lengths
  double gradient_limit = 1.0;  // of |grad s|, per edge length
  int max_iterations = 1000;
  double tolerance = 1e-4;
  DeviceUse* device = nullptr;  // where it is solved; null: on the CPU
  LinkCopies* links = nullptr;  // of the same grid and codes; null: made for this solve
};

// [node_count] edge lengths along the three axes of `frames`, in
// [min_size, max_size] before the last rescaling, which makes the mean of 1 / (h_0 h_1 h_2) one.
absl::StatusOr<std::vector<Vec3d>> SolveSizeField(const BackgroundGrid& grid,
                                                  const std::vector<Quaternion>& frames,
                                                  const ForwardCodes& codes,
                                                  const SizeSettings& settings,
                                                  const ProgressSlice& slice);

}  // namespace amhex::fields
