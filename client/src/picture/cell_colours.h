// What the colours of a picture say, cell by cell.
#pragma once

#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/volume_mesh.h"
#include "picture/raster.h"

namespace amhex::client {

enum class Colouring {
  kType,      // hexahedra or not
  kQuality,   // scaled Jacobian: red 0, yellow 0.5, blue 1
  kDistance,  // to the input: blue none, red the 99th of a hundred and beyond, grey not measured
};

// By type, where faces on the hull differ from those inside.
inline constexpr Colour kHullColour = {0.94f, 0.93f, 0.90f};        // the mesh's boundary
inline constexpr Colour kHexahedronColour = {0.62f, 0.76f, 0.96f};  // inner faces of hexahedra
inline constexpr Colour kOtherCellColour = {1.00f, 0.80f, 0.16f};   // inner faces of other cells
inline constexpr Colour kHullOtherColour = {0.99f, 0.91f, 0.62f};   // their faces on the boundary
// Of cells whose distance was not measured: those inside, for the most part.
inline constexpr Colour kNotMeasuredColour = {0.78f, 0.80f, 0.82f};

// From red over yellow to blue, as in the report's page, for a fraction in [0, 1].
Colour RampColour(double fraction);

// The colour of each cell's inner faces; of all its faces, unless by type.
// `distances`: [cell_count], NaN where there is none; FAILED_PRECONDITION if they are wanted and
// missing.
absl::StatusOr<std::vector<Colour>> ColoursOfCells(const AtMostHexaMesh& mesh, Colouring colouring,
                                                   std::span<const float> distances);

}  // namespace amhex::client
