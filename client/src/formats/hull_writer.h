// Writes surfaces and clouds: .drc .ply .obj .off .stl .xyz.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "amhex/input_hull.h"
#include "formats/hull_reader.h"

namespace amhex::client {

// The file's bytes. `.drc` and `.ply` keep clouds with normals; `.stl` is binary and holds
// surfaces only (INVALID_ARGUMENT for clouds), `.xyz` clouds only. `.ply` is binary little-endian
// with 64-bit coordinates; in `.drc` no position moves by more than `tolerance`.
absl::StatusOr<std::string> FormatHull(const InputHull& hull, HullFormat format,
                                       double tolerance = 0);

// Writes by extension. The file appears whole or not at all.
absl::Status WriteHullFile(const InputHull& hull, const std::string& path, double tolerance = 0);

// Writes `bytes` to a file beside `path` and renames it, so that nobody sees half a file.
// Errors name the path and the system's reason.
absl::Status WriteWholeFile(const std::string& path, const std::string& bytes);

}  // namespace amhex::client
