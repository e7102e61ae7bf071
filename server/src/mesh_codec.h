// AtMostHexaMesh <-> MESH_ENCODING_ARRAYS (geometry.proto).
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "amhex/volume_mesh.h"

namespace amhex::server {

// Size of the encoded mesh in bytes.
int64_t EncodedMeshBytes(const AtMostHexaMesh& mesh);

// Writes the encoded mesh to a new file, array by array, without a second copy in memory.
// RESOURCE_EXHAUSTED STORAGE_FULL when the disk is full.
absl::Status WriteMeshFile(const AtMostHexaMesh& mesh, const std::string& path);

// INVALID_ARGUMENT when `bytes` are no encoded mesh: wrong header, size, type or vertex index.
absl::StatusOr<AtMostHexaMesh> DecodeMesh(const std::string& bytes);

}  // namespace amhex::server
