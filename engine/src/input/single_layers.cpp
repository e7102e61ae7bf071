#include "input/single_layers.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "input/triangle_math.h"

namespace amhex {
namespace {

// Mean thickness, in edge lengths, from which on nothing is asked.
constexpr double kThickSolid = 2.0;
// What has one layer, in edge lengths: from where walls are kept (fields/wall_question.h) to where
// two layers are as near.
constexpr double kThinnest = 0.5;
constexpr double kThickest = 1.5;
// Walls stay so far within that, as trials are of several densities.
constexpr double kMargin = 0.05;
constexpr double kPointCount = 4'000;
// Rays start this far below the surface, ends are looked for this far around, in edge lengths.
constexpr double kRayStart = 1e-3;
constexpr double kEndReach = 1e-2;
// Sides within some 14 degrees are parallel (as in fields/wall_question.h).
constexpr double kParallelCosine = 0.97;
// A number of cells that is this near to the wanted one is as good (closure/rank_complexes).
constexpr double kFreeDeviation = 0.12;
constexpr int kBisections = 50;
// One in so many of the places that are too thin may be thinner than what is told.
constexpr size_t kThinnestOf = 10;

struct Corners {
  Vec3d a, b, c;
};

Corners CornersOf(const SurfaceOfSolid& solid, size_t triangle) {
  const auto& t = solid.triangles[triangle];
  return {solid.vertices[static_cast<size_t>(t[0])], solid.vertices[static_cast<size_t>(t[1])],
          solid.vertices[static_cast<size_t>(t[2])]};
}

double AreaOf(const SurfaceOfSolid& solid) {
  double area = 0;
  for (size_t i = 0; i < solid.triangles.size(); ++i) {
    const Corners corners = CornersOf(solid, i);
    area += Norm(DoubleAreaVector(corners.a, corners.b, corners.c)) / 2;
  }
  return area;
}

// The k-th of points that fill a triangle evenly: the sequence of the plastic number (Roberts, "The
// Unreasonable Effectiveness of Quasirandom Sequences"), folded. None is on a side.
Vec3d PointOf(const Corners& corners, int64_t k) {
  constexpr double kFirst = 0.7548776662466927;
  constexpr double kSecond = 0.5698402909980532;
  const auto index = static_cast<double>(k + 1);
  double u = 0.5 + kFirst * index, v = 0.5 + kSecond * index;
  u -= std::floor(u), v -= std::floor(v);
  if (u + v > 1) u = 1 - u, v = 1 - v;
  return corners.a + (corners.b - corners.a) * u + (corners.c - corners.a) * v;
}

struct SurfacePoint {
  Vec3d at;
  Vec3d normal;
  double area = 0;  // that it stands for
};

// Calls visit(point) for some thousand points, as many as each triangle's area asks for.
template <class Visit>
void ForEachPoint(const SurfaceOfSolid& solid, const StopPoll& poll, const Visit& visit) {
  const double spacing = AreaOf(solid) / kPointCount;
  double passed = 0.5;  // of the area, in spacings
  for (size_t i = 0; i < solid.triangles.size(); ++i) {
    poll.At(static_cast<int64_t>(i));
    const Corners corners = CornersOf(solid, i);
    const Vec3d area_vector = DoubleAreaVector(corners.a, corners.b, corners.c);
    passed += Norm(area_vector) / 2 / spacing;
    const auto points = static_cast<int64_t>(passed);
    if (points == 0 || IsDegenerate(corners.a, corners.b, corners.c)) continue;
    passed -= static_cast<double>(points);
    const Vec3d normal = Normalized(area_vector);
    for (int64_t k = 0; k < points; ++k) {
      poll.At(k);
      visit(SurfacePoint{PointOf(corners, k), normal, spacing});
    }
  }
}

// Of the wall below a point of the surface; negative where no parallel side is opposite.
double WallThicknessAt(const SurfacePoint& point, const HullQueries& queries, double edge_length) {
  const double thickness = queries.ExitDistance(point.at, -point.normal, kRayStart * edge_length);
  if (!(thickness > 0)) return -1;
  const HullPoint end =
      queries.Closest(point.at - point.normal * thickness, kEndReach * edge_length);
  return end.triangle >= 0 && Dot(end.normal, point.normal) < -kParallelCosine ? thickness : -1;
}

void AddWall(double area, double thickness, SingleLayers& walls) {
  walls.thinnest = walls.area == 0 ? thickness : std::min(walls.thinnest, thickness);
  walls.thickest = std::max(walls.thickest, thickness);
  walls.area += area / 2;  // seen from both sides
  walls.volume += area / 2 * thickness;
}

}  // namespace

bool MayHaveSingleLayers(const SurfaceOfSolid& solid, double edge_length) {
  return 2 * solid.volume < kThickSolid * edge_length * AreaOf(solid);
}

SingleLayers FindSingleLayers(const SurfaceOfSolid& solid, const HullQueries& queries,
                              double edge_length, const StopPoll& poll) {
  SingleLayers walls;
  if (!MayHaveSingleLayers(solid, edge_length)) return walls;
  ForEachPoint(solid, poll, [&](const SurfacePoint& point) {
    const double thickness = WallThicknessAt(point, queries, edge_length);
    if (thickness < kThinnest * edge_length || thickness >= kThickest * edge_length) return;
    AddWall(point.area, thickness, walls);
  });
  return walls;
}

ThinPart FindThinPart(const SurfaceOfSolid& solid, const HullQueries& queries, double edge_length,
                      const StopPoll& poll) {
  struct Place {
    double thickness = 0;
    Vec3d middle;
  };
  std::vector<Place> places;
  double area = 0, thin_area = 0;
  ForEachPoint(solid, poll, [&](const SurfacePoint& point) {
    area += point.area;
    const double thickness = queries.ExitDistance(point.at, -point.normal, kRayStart * edge_length);
    if (!(thickness > 0) || thickness >= kThinnest * edge_length) return;
    thin_area += point.area;
    places.push_back({thickness, point.at - point.normal * (thickness / 2)});
  });
  ThinPart part;
  if (places.empty()) return part;
  std::stable_sort(places.begin(), places.end(),
                   [](const Place& a, const Place& b) { return a.thickness < b.thickness; });
  part.area_ratio = thin_area / area;
  part.thickness = places[places.size() / 2].thickness;
  part.thinnest = places[places.size() / kThinnestOf].thickness;
  part.place = places[places.size() / 2].middle;
  return part;
}

double LongestEdgeFor(double thickness) { return thickness / (kThinnest + kMargin); }

double EdgeLengthWithLayers(const SingleLayers& walls, double volume, double edge_length) {
  const auto cells = [&](double h) { return volume / (h * h * h) + walls.ExcessCells(h); };
  const double wanted = volume / (edge_length * edge_length * edge_length);
  if (std::abs(cells(edge_length) / wanted - 1) <= kFreeDeviation) return edge_length;
  double low = std::min(edge_length, walls.thickest / (kThickest - kMargin));
  double high = std::max(edge_length, walls.thinnest / (kThinnest + kMargin));
  if (cells(low) <= wanted) return low;
  if (cells(high) >= wanted) return high;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = (low + high) / 2;
    (cells(middle) > wanted ? low : high) = middle;
  }
  return (low + high) / 2;
}

}  // namespace amhex
