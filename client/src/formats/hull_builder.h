// Collects what a reader finds and turns it into an InputHull, checking as it goes.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "amhex/input_hull.h"

namespace amhex::client {

// Most corners a face may have. Larger polygons are refused: clipping their ears is quadratic.
inline constexpr int kMaxPolygonCorners = 1024;

// Splits a polygon, convex or not, into triangles of the same orientation by clipping ears; a quad
// is split by the diagonal that bends its two halves least. `corners` index into `vertices` and
// must be valid. Appends `corners.size() - 2` triangles. O(n^2) for ordinary polygons.
void TriangulatePolygon(std::span<const int32_t> corners, const std::vector<Vec3d>& vertices,
                        std::vector<std::array<int32_t, 3>>* triangles);

// Readers fill this; `Build` checks the whole and decides between mesh and cloud.
class HullBuilder {
 public:
  std::vector<Vec3d> vertices;
  std::vector<Vec3d> normals;  // one per vertex, or empty

  // Adds a polygon of zero-based vertex numbers. The error says what is wrong, without a place.
  // Indices are checked against the vertices in Build, as some formats name vertices later.
  absl::Status AddPolygon(std::span<const int64_t> corners);

  bool has_faces() const { return !face_sizes_.empty(); }

  // A mesh when there is any face, otherwise a cloud. INVALID_ARGUMENT if there is no vertex, a
  // coordinate is not finite, or a face names a vertex that is not there.
  absl::StatusOr<InputHull> Build();

 private:
  std::vector<int32_t> face_sizes_;
  std::vector<int32_t> face_corners_;
};

// INVALID_ARGUMENT naming the first coordinate that is not finite.
absl::Status CheckFinite(const std::vector<Vec3d>& vectors, const char* what);

}  // namespace amhex::client
