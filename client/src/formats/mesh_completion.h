// Fills in what a mesh file leaves unsaid.
#pragma once

#include "absl/status/status.h"
#include "amhex/volume_mesh.h"

namespace amhex::client {

// Sets types from the cells' faces, and quality from their geometry where `mesh->quality` is
// empty. INVALID_ARGUMENT naming a corner that is no vertex or a cell of no known type.
absl::Status CompleteMesh(AtMostHexaMesh* mesh);

}  // namespace amhex::client
