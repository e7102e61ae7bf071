#include "input/build_hull.h"

#include <cmath>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "input/close_mesh.h"
#include "input/edge_length.h"
#include "input/hull_checks.h"
#include "input/hull_queries.h"
#include "input/rebuild_surface.h"
#include "input/sharp_features.h"
#include "input/surface_topology.h"
#include "input/triangle_math.h"

namespace amhex {
namespace {

// Of the cube of the box diagonal: a plate one millionth as thick as it is long holds more.
constexpr double kSmallestVolumeRatio = 1e-9;

const std::vector<Vec3d>& PointsOf(const InputHull& input) {
  if (const auto* mesh = std::get_if<TriangleMesh>(&input)) return mesh->vertices;
  return std::get<PointCloud>(input).points;
}

// Points that count: a mesh's unused vertices may lie anywhere.
Box3d BoxOf(const InputHull& input) {
  Box3d box;
  if (const auto* mesh = std::get_if<TriangleMesh>(&input)) {
    for (const auto& t : mesh->triangles) {
      for (const int32_t v : t) box.Extend(mesh->vertices[static_cast<size_t>(v)]);
    }
  } else {
    for (const Vec3d& p : PointsOf(input)) box.Extend(p);
  }
  return box;
}

// The frame in which the box has its centre at the origin and a diagonal of 1.
Frame UnitFrame(const Box3d& box) { return {(box.low + box.high) / 2.0, box.Diagonal()}; }

std::vector<Vec3d> InUnitFrame(const std::vector<Vec3d>& points, const Frame& frame) {
  std::vector<Vec3d> result;
  result.reserve(points.size());
  for (const Vec3d& p : points) result.push_back(frame.ToNormalized(p));
  return result;
}

absl::StatusOr<ClosedSurface> CloseInput(const InputHull& input, const Frame& frame,
                                         const SizingParams& sizing, RunContext& run) {
  const WantedSize wanted{sizing.cell_count, sizing.edge_length / frame.scale};
  if (const auto* mesh = std::get_if<TriangleMesh>(&input)) {
    return CloseMesh({InUnitFrame(mesh->vertices, frame), mesh->triangles}, wanted, run);
  }
  const auto& cloud = std::get<PointCloud>(input);
  return RebuildFromCloud({InUnitFrame(cloud.points, frame), cloud.normals}, wanted, run);
}

void ComputeNormals(const EdgeAdjacency& adjacency, Hull& hull) {
  hull.triangle_normals.assign(hull.triangles.size(), Vec3d{});
  std::vector<size_t> degenerate;
  for (size_t t = 0; t < hull.triangles.size(); ++t) {
    const auto& corners = hull.triangles[t];
    const Vec3d& a = hull.vertices[static_cast<size_t>(corners[0])];
    const Vec3d& b = hull.vertices[static_cast<size_t>(corners[1])];
    const Vec3d& c = hull.vertices[static_cast<size_t>(corners[2])];
    if (IsDegenerate(a, b, c)) {
      degenerate.push_back(t);
    } else {
      hull.triangle_normals[t] = Normalized(DoubleAreaVector(a, b, c));
    }
  }
  // A triangle without area takes the normal of a neighbour that has one, nearest ones first.
  for (bool progress = true; progress && !degenerate.empty();) {
    progress = false;
    std::vector<size_t> remaining;
    for (const size_t t : degenerate) {
      for (size_t e = 3 * t; e < 3 * t + 3 && hull.triangle_normals[t] == Vec3d{}; ++e) {
        const HalfEdgeId other = adjacency.opposite[e];
        if (other >= 0)
          hull.triangle_normals[t] = hull.triangle_normals[static_cast<size_t>(other / 3)];
      }
      const bool found = !(hull.triangle_normals[t] == Vec3d{});
      progress = progress || found;
      if (!found) remaining.push_back(t);
    }
    degenerate = std::move(remaining);
  }
}

double VolumeOf(const TriangleMesh& mesh) {
  double volume = 0;
  for (const auto& t : mesh.triangles) {
    volume += Determinant(mesh.vertices[static_cast<size_t>(t[0])],
                          mesh.vertices[static_cast<size_t>(t[1])],
                          mesh.vertices[static_cast<size_t>(t[2])]) /
              6;
  }
  return volume;
}

}  // namespace

absl::StatusOr<Hull> BuildHull(const InputHull& input, const MeshingParams& params,
                               RunContext& run) {
  AMHEX_RETURN_IF_ERROR(Validate(params));
  AMHEX_RETURN_IF_ERROR(CheckInput(input));
  const Frame unit = UnitFrame(BoxOf(input));
  if (!(unit.scale > 0)) {
    return absl::InvalidArgumentError("the input's triangles are all at one point");
  }
  absl::StatusOr<ClosedSurface> closed = CloseInput(input, unit, params.sizing, run);
  if (!closed.ok()) return closed.status();
  AMHEX_RETURN_IF_ERROR(run.CheckStop());

  TriangleMesh& solid = closed->mesh;
  const double volume = VolumeOf(solid);
  if (!(volume > kSmallestVolumeRatio)) {
    return absl::InvalidArgumentError(
        absl::StrCat("the input encloses no volume: ", volume, " of its box diagonal cubed"));
  }
  const HullQueries unit_queries(solid.vertices, solid.triangles);
  const absl::StatusOr<double> edge_length =
      ResolveEdgeLength(params.sizing, solid, unit_queries, volume, unit.scale);
  if (!edge_length.ok()) return edge_length.status();
  const double h = *edge_length;

  Hull hull;
  hull.frame = {unit.origin, unit.scale * h};
  hull.vertices = std::move(solid.vertices);
  for (Vec3d& p : hull.vertices) p /= h;
  hull.triangles = std::move(solid.triangles);
  for (const Vec3d& p : hull.vertices) hull.box.Extend(p);
  hull.volume = volume / (h * h * h);
  hull.warnings = std::move(closed->warnings);
  hull.queries = std::make_shared<const HullQueries>(hull.vertices, hull.triangles);

  const TriangleMesh topology{hull.vertices, hull.triangles};
  const EdgeAdjacency adjacency = FindEdgeAdjacency(topology);
  const Components components = FindComponents(adjacency);
  hull.component_count = components.count;
  hull.genus = adjacency.IsClosedManifold() ? GenusOf(topology, adjacency, components) : -1;
  ComputeNormals(adjacency, hull);
  FindSharpFeatures(params.input.sharp_angle_degrees, adjacency, hull);
  if (std::holds_alternative<PointCloud>(input)) {
    hull.input_points = InUnitFrame(PointsOf(input), hull.frame);
  } else {
    hull.input_points = hull.vertices;
  }
  return hull;
}

}  // namespace amhex
