#include "input/edge_length.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "input/ask_hull.h"
#include "input/single_layers.h"
#include "input/triangle_math.h"
#include "input/width_question.h"

namespace amhex {
namespace {

constexpr size_t kMostWidthProbes = 4'000;
constexpr double kWidthPercentile = 0.10;
constexpr double kCellsPerWidth = 2;
// Rays start this far inside, in square roots of the triangle's area.
constexpr double kRayStartRatio = 1e-3;

// Thickness below which only 10 % of the surface lies; a negative number if nothing was hit.
double MinimumWidth(const TriangleMesh& solid, const StopPoll& poll, DeviceUse* device) {
  const HullQueries queries(solid.vertices, solid.triangles, poll, device, HullAskers::kDevice);
  const size_t step = std::max<size_t>(1, solid.triangles.size() / kMostWidthProbes);
  std::vector<InwardRay> rays;
  std::vector<double> areas;
  for (size_t i = 0; i < solid.triangles.size(); i += step) {
    const auto& t = solid.triangles[i];
    const Vec3d& a = solid.vertices[static_cast<size_t>(t[0])];
    const Vec3d& b = solid.vertices[static_cast<size_t>(t[1])];
    const Vec3d& c = solid.vertices[static_cast<size_t>(t[2])];
    if (IsDegenerate(a, b, c)) continue;
    const Vec3d area_vector = DoubleAreaVector(a, b, c);
    const double area = Norm(area_vector) / 2;
    rays.push_back({(a + b + c) / 3.0, -Normalized(area_vector), kRayStartRatio * std::sqrt(area)});
    areas.push_back(area);
  }
  if (rays.empty()) return -1;
  const std::vector<double> widths =
      HullAsker(queries, device, poll)
          .AskOrThrow(WidthAt{{{rays.data(), static_cast<int64_t>(rays.size())}}});
  std::vector<std::pair<double, double>> width_and_area;
  double total_area = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    if (widths[i] < 0) continue;
    width_and_area.emplace_back(widths[i], areas[i]);
    total_area += areas[i];
  }
  std::sort(width_and_area.begin(), width_and_area.end());
  double area_below = 0;
  for (const auto& [width, area] : width_and_area) {
    area_below += area;
    if (area_below >= kWidthPercentile * total_area) return width;
  }
  return -1;
}

// Only the host asks for walls. A hierarchy of fewer triangles is built here within tenths of a
// second, and need not cross to the device and back.
constexpr size_t kTrianglesForDevice = 200'000;

double EdgeLengthOf(double volume, int64_t cell_count) {
  return std::cbrt(volume / static_cast<double>(cell_count));
}

// Makes so many cells, whole or in walls of one layer.
double EdgeLengthFor(int64_t cell_count, const TriangleMesh& solid, double volume,
                     const StopPoll& poll, DeviceUse* device) {
  const double cubes = EdgeLengthOf(volume, cell_count);
  const SurfaceOfSolid surface{solid.vertices, solid.triangles, volume};
  if (!MayHaveSingleLayers(surface, cubes)) return cubes;
  const bool is_large = solid.triangles.size() > kTrianglesForDevice;
  const HullQueries queries(solid.vertices, solid.triangles, poll, is_large ? device : nullptr);
  const SingleLayers walls = FindSingleLayers(surface, queries, cubes, poll);
  return EdgeLengthWithLayers(walls, volume, cubes);
}

}  // namespace

absl::StatusOr<double> ResolveEdgeLength(const SizingParams& sizing, const TriangleMesh& solid,
                                         double volume, double user_scale, const StopPoll& poll,
                                         DeviceUse* device) {
  if (sizing.edge_length > 0) {
    const double edge_length = sizing.edge_length / user_scale;
    const double cells = volume / edge_length / edge_length / edge_length;
    if (!(cells <= static_cast<double>(kMaxCellCount))) {
      return absl::OutOfRangeError(absl::StrCat(
          "sizing.edge_length is ", sizing.edge_length, ", which makes about ", cells,
          " cells of the input; the limit is ", kMaxCellCount, " cells, an edge length of ",
          EdgeLengthOf(volume, kMaxCellCount) * user_scale));
    }
    if (cells < 1) {
      return absl::InvalidArgumentError(absl::StrCat("sizing.edge_length is ", sizing.edge_length,
                                                     ", longer than the input can hold: its "
                                                     "volume makes one cell of edge length ",
                                                     EdgeLengthOf(volume, 1) * user_scale));
    }
    return sizing.edge_length;
  }
  if (sizing.cell_count > 0) {
    return EdgeLengthFor(sizing.cell_count, solid, volume, poll, device) * user_scale;
  }
  const double by_count = EdgeLengthOf(volume, kDefaultCellCount);
  const double width = MinimumWidth(solid, poll, device);
  if (width <= 0) return by_count * user_scale;
  const double edge_length = std::max(std::min(by_count, width / kCellsPerWidth),
                                      EdgeLengthOf(volume, kMaxDefaultCellCount));
  return edge_length * user_scale;
}

}  // namespace amhex
