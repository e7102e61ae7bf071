// Fills in what a mesh file leaves unsaid.
#pragma once

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "amhex/volume_mesh.h"
#include "formats/volume_builder.h"

namespace amhex::client {

// Sets types from the cells' faces, and quality from their geometry where `mesh->quality` is
// empty. INVALID_ARGUMENT naming a corner that is no vertex or a cell of no known type.
absl::Status CompleteMesh(AtMostHexaMesh* mesh);

// What a reader has collected, completed. INVALID_ARGUMENT, too, naming a cell that is no
// hexahedron, collapsed or not.
absl::StatusOr<AtMostHexaMesh> MeshOf(VolumeBuilder builder);

}  // namespace amhex::client
