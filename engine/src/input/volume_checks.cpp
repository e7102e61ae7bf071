#include "input/volume_checks.h"

#include <cstdint>
#include <limits>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "input/offenders.h"

namespace amhex {
namespace {

constexpr int kFewestFaces = 4;
constexpr int kFewestCorners = 3;
// Half-faces are numbered in 32 bits, and a broken cell has a few per face.
constexpr size_t kMostCorners = std::numeric_limits<int32_t>::max() / 8;

// Every entry of `counts` is at least `least`, and their sum is `total`.
absl::Status CheckCounts(const std::vector<int32_t>& counts, int least, size_t total,
                         const char* what, const char* parts) {
  Offenders offenders;
  size_t sum = 0;
  for (size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] < least) {
      offenders.Add(i);
    } else {
      sum += static_cast<size_t>(counts[i]);
    }
  }
  if (offenders.Any()) {
    return absl::InvalidArgumentError(absl::StrCat(offenders.Describe(what), " has ",
                                                   counts[offenders.first()], " ", parts,
                                                   ": at least ", least, " are needed"));
  }
  if (sum == total) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("the ", what, "s have ", sum, " ", parts, ", but ", total, " are listed"));
}

}  // namespace

absl::Status CheckVolumeLists(const VolumeMesh& mesh) {
  if (mesh.cell_faces.empty()) {
    return absl::InvalidArgumentError("the input volume mesh has no cells");
  }
  if (mesh.corners.size() > kMostCorners || mesh.vertices.size() > kMostCorners) {
    return absl::OutOfRangeError(absl::StrCat("the input's cells have ", mesh.corners.size(),
                                              " corners of faces, the limit is ", kMostCorners));
  }
  AMHEX_RETURN_IF_ERROR(
      CheckCounts(mesh.cell_faces, kFewestFaces, mesh.face_corners.size(), "cell", "faces"));
  AMHEX_RETURN_IF_ERROR(
      CheckCounts(mesh.face_corners, kFewestCorners, mesh.corners.size(), "face", "corners"));
  const auto vertex_count = static_cast<int64_t>(mesh.vertices.size());
  Offenders offenders;
  int32_t first_index = 0;
  size_t face = 0, corner = 0;
  for (size_t cell = 0; cell < mesh.cell_faces.size(); ++cell) {
    bool is_wrong = false;
    for (int f = 0; f < mesh.cell_faces[cell]; ++f, ++face) {
      for (int i = 0; i < mesh.face_corners[face]; ++i, ++corner) {
        const int32_t v = mesh.corners[corner];
        if (v >= 0 && v < vertex_count) continue;
        if (!is_wrong && !offenders.Any()) first_index = v;
        is_wrong = true;
      }
    }
    if (is_wrong) offenders.Add(cell);
  }
  if (!offenders.Any()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(offenders.Describe("cell"), " names vertex ",
                                                 first_index, ": indices must be in [0, ",
                                                 vertex_count, ")"));
}

}  // namespace amhex
