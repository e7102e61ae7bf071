// A picture of a mesh, cut open.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "absl/status/statusor.h"
#include "amhex/volume_mesh.h"
#include "picture/cell_colours.h"
#include "picture/image.h"
#include "picture/raster.h"

namespace amhex::client {

// Cells whose centres lie beyond the plane, towards the viewer, are left out.
struct Cut {
  int axis = 1;           // 0, 1, 2: x, y, z
  double fraction = 0.5;  // [0, 1] of the mesh's box along the axis; 0 or 1 may leave it whole
};

// "x", "y:0.3", "z:0.5". INVALID_ARGUMENT for anything else.
absl::StatusOr<Cut> ParseCut(const std::string& text);

// Perpendicular to the box's shortest side through its middle: the largest section.
Cut DefaultCut(const AtMostHexaMesh& mesh);

struct PictureOptions {
  int width = 1200, height = 900;  // pixels, [16, 8192]
  std::optional<Cut> cut;          // nullopt = the whole mesh from outside
  Colouring colouring = Colouring::kType;
  std::span<const float> distances = {};  // [cell_count]; kDistance wants them
};

// "1200x900". INVALID_ARGUMENT for anything else or out of range.
absl::Status ParseSize(const std::string& text, PictureOptions* options);

inline constexpr Colour kBackgroundColour = {1.0f, 1.0f, 1.0f};

// Draws faces flat-shaded with their edges, seen from in front, to the right and above.
// INVALID_ARGUMENT naming the option, DATA_LOSS if the cells do not fit together,
// FAILED_PRECONDITION if the cut leaves no cell or distances are missing.
absl::StatusOr<Image> DrawMesh(const AtMostHexaMesh& mesh, const PictureOptions& options);

}  // namespace amhex::client
