// The report: one HTML file that shows a mesh in three dimensions and its figures, without network.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "formats/mesh_file.h"

namespace amhex::client {

// The page: three.js, the mesh as compressed arrays, the facts. `title` heads it, e.g. the
// file's name. DATA_LOSS if the cells do not fit together. O(n) for n cells; about 25 bytes each.
absl::StatusOr<std::string> FormatReportPage(const MeshDocument& document,
                                             const std::string& title);

}  // namespace amhex::client
