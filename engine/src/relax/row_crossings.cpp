#include "relax/row_crossings.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace amhex {
namespace {

// 1 GiB of crossings; a hull of five million cells has some three million.
constexpr size_t kMaxCrossings = size_t{1} << 26;
constexpr size_t kTrianglesPerPoll = 4096;

// Side of the point (y, z) as seen along the edge from vertex i to vertex j: +1 left, -1 right,
// 0 if the edge is a point. The same two vertices give opposite answers in both directions.
int SideOfEdge(const Hull& hull, int32_t i, int32_t j, double y, double z) {
  const bool is_forward = i < j;
  const Vec3d& a = hull.vertices[static_cast<size_t>(is_forward ? i : j)];
  const Vec3d& b = hull.vertices[static_cast<size_t>(is_forward ? j : i)];
  const double dy = b.y - a.y;
  const double dz = b.z - a.z;
  double side = dy * (z - a.z) - dz * (y - a.y);
  // On the line: step by (epsilon, epsilon^2).
  if (side == 0) side = -dz;
  if (side == 0) side = dy;
  const int sign = side > 0 ? 1 : (side < 0 ? -1 : 0);
  return is_forward ? sign : -sign;
}

class Crosser {
 public:
  Crosser(const Hull& hull, const Vec3d& origin, const FccLattice& lattice)
      : hull_(hull), origin_(origin), lattice_(lattice) {}

  void CrossTriangle(const std::array<int32_t, 3>& triangle, std::vector<RowCrossing>& found) {
    const Vec3d& a = hull_.vertices[static_cast<size_t>(triangle[0])];
    const Vec3d& b = hull_.vertices[static_cast<size_t>(triangle[1])];
    const Vec3d& c = hull_.vertices[static_cast<size_t>(triangle[2])];
    const Vec3d normal = Cross(b - a, c - a);
    const Range rows_y = RowsOver(a.y, b.y, c.y, origin_.y, lattice_.tiles_y);
    const Range rows_z = RowsOver(a.z, b.z, c.z, origin_.z, lattice_.tiles_z);
    const double x_low = std::min({a.x, b.x, c.x});
    const double x_high = std::max({a.x, b.x, c.x});
    for (int32_t row_z = rows_z.begin; row_z < rows_z.end; ++row_z) {
      for (int32_t row_y = rows_y.begin; row_y < rows_y.end; ++row_y) {
        const double y = origin_.y + row_y * lattice_.spacing;
        const double z = origin_.z + row_z * lattice_.spacing;
        const int side = SideOfEdge(hull_, triangle[0], triangle[1], y, z);
        if (side == 0 || side != SideOfEdge(hull_, triangle[1], triangle[2], y, z) ||
            side != SideOfEdge(hull_, triangle[2], triangle[0], y, z)) {
          continue;
        }
        // Seen along +x a triangle that turns left has its normal towards +x: the row leaves.
        double x = x_low;
        if (normal.x != 0) x = a.x - (normal.y * (y - a.y) + normal.z * (z - a.z)) / normal.x;
        x = std::clamp(x, x_low, x_high);
        found.push_back({RowIndex(lattice_, row_y, row_z), -side, x - origin_.x});
      }
    }
  }

 private:
  struct Range {
    int32_t begin = 0;
    int32_t end = 0;
  };

  // Rows within the interval of three coordinates; one more on both sides for rounding.
  Range RowsOver(double a, double b, double c, double origin, int32_t tiles) const {
    const double low = (std::min({a, b, c}) - origin) / lattice_.spacing;
    const double high = (std::max({a, b, c}) - origin) / lattice_.spacing;
    const double last = tiles * kTileWidth - 1;
    return {static_cast<int32_t>(std::clamp(std::floor(low), 0.0, last)),
            static_cast<int32_t>(std::clamp(std::ceil(high), 0.0, last)) + 1};
  }

  const Hull& hull_;
  const Vec3d origin_;
  const FccLattice lattice_;
};

}  // namespace

absl::StatusOr<std::vector<RowCrossing>> CrossRows(const Hull& hull, const Vec3d& origin,
                                                   const FccLattice& lattice,
                                                   const RunContext& run) {
  std::vector<RowCrossing> crossings;
  Crosser crosser(hull, origin, lattice);
  for (size_t t = 0; t < hull.triangles.size(); ++t) {
    if (t % kTrianglesPerPoll == 0) AMHEX_RETURN_IF_ERROR(run.CheckStop());
    crosser.CrossTriangle(hull.triangles[t], crossings);
    if (crossings.size() > kMaxCrossings) {
      return absl::ResourceExhaustedError(
          absl::StrCat("the hull crosses the lattice more than ", kMaxCrossings,
                       " times; it folds over itself or asks for too many cells"));
    }
  }
  tbb::parallel_sort(crossings, [](const RowCrossing& a, const RowCrossing& b) {
    return std::tie(a.row, a.x, a.sign) < std::tie(b.row, b.x, b.sign);
  });
  return crossings;
}

}  // namespace amhex
