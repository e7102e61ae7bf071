// Reads surface meshes and point clouds: .drc .ply .obj .off .stl .xyz.
//
// Every reader takes the whole file as bytes that may come from anywhere: counts are checked
// against the bytes present before memory is reserved, and errors name the line or byte.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"

namespace amhex::client {

enum class HullFormat : uint8_t { kDraco, kPly, kObj, kOff, kStl, kXyz };

// By file extension, in any case, .pts and .asc being .xyz; nullopt for every other extension.
std::optional<HullFormat> HullFormatOfPath(const std::string& path);
inline constexpr const char* kHullExtensions = ".drc, .ply, .obj, .off, .stl, .xyz, .pts, .asc";

// Largest file that is read, in bytes.
inline constexpr int64_t kMaxInputFileBytes = int64_t{4} << 30;

// NOT_FOUND or PERMISSION_DENIED if the file cannot be opened, INVALID_ARGUMENT if it is larger
// than `kMaxInputFileBytes` or a directory. Messages begin with the path.
absl::StatusOr<std::string> ReadWholeFile(const std::string& path);

// Reads `path` by its extension. Polygons are triangulated, vertices of STL files welded where
// they are equal, units left untouched. Errors begin with the path and are INVALID_ARGUMENT for
// anything wrong with the contents.
absl::StatusOr<InputHull> ReadHullFile(const std::string& path);

absl::StatusOr<InputHull> ReadHull(HullFormat format, std::string_view bytes);

// The formats one by one; messages do not name the file.
absl::StatusOr<InputHull> ReadDraco(std::string_view bytes);  // meshes and clouds
absl::StatusOr<InputHull> ReadPly(std::string_view bytes);    // ascii and both byte orders
absl::StatusOr<InputHull> ReadObj(std::string_view bytes);    // v, vn, f
absl::StatusOr<InputHull> ReadOff(std::string_view bytes);    // OFF, COFF, NOFF and so on
absl::StatusOr<InputHull> ReadStl(std::string_view bytes);    // ascii and binary
// A line per point: its position, perhaps other numbers, perhaps its normal. Numbers are separated
// by blanks, commas or semicolons. The normal is what has unit length on every line, in the last
// three columns or right after the position. Lines that begin with # or // are comments; a first
// line that holds names or a number of points alone is skipped.
absl::StatusOr<InputHull> ReadXyz(std::string_view bytes);

}  // namespace amhex::client
