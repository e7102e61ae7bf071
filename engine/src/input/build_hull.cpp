#include "input/build_hull.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <optional>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "cost_model.h"
#include "cuda/device_use.h"
#include "input/ask_hull.h"
#include "input/close_mesh.h"
#include "input/drop_strays.h"
#include "input/edge_length.h"
#include "input/hull_checks.h"
#include "input/hull_queries.h"
#include "input/merge_needles.h"
#include "input/rebuild_surface.h"
#include "input/sharp_features.h"
#include "input/surface_topology.h"
#include "input/triangle_math.h"
#include "input/upright_axes.h"
#include "reassembly/break_down.h"

namespace amhex {
namespace {

// Of the cube of the box diagonal: a plate one millionth as thick as it is long holds more.
constexpr double kSmallestVolumeRatio = 1e-9;
// Flat parts across the axes of the background grid leave more singularities of its fields. Worth a
// turn from such a share of the area on; nothing else is turned, as every lattice has its luck.
constexpr double kWorthTurning = 0.1;
// Of the edge length: a volume is counted to three times this share before there is a surface.
constexpr double kSameSizeRatio = 0.02;
// Share of this stage's time that a closed surface takes.
constexpr double kClosedFraction = 0.7;
// Edge lengths from the hull within which a mesh that reaches the hull reaches a point.
constexpr double kNearHull = 0.75;

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
  const WantedSize wanted{sizing.cell_count, sizing.edge_length, frame.scale};
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

void ReportFraction(double fraction, RunContext& run) {
  Progress progress = run.progress();
  progress.stage_fraction = fraction;
  run.Report(progress);
}

int64_t ElementCount(const InputHull& input) {
  if (const auto* mesh = std::get_if<TriangleMesh>(&input)) {
    return static_cast<int64_t>(mesh->triangles.size());
  }
  if (const auto* volume = std::get_if<VolumeMesh>(&input)) {
    return static_cast<int64_t>(volume->cell_faces.size());
  }
  return static_cast<int64_t>(std::get<PointCloud>(input).points.size());
}

// The cells are known now, better than any estimate before the run could know them.
absl::Status CheckMemory(double cells, const InputHull& input, int64_t limit) {
  const auto cell_count = static_cast<int64_t>(cells);
  const int64_t bytes = ExpectedMemoryBytes(cell_count, ElementCount(input));
  if (limit == 0 || bytes <= limit) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("about ", bytes, " bytes are needed for ",
                                                   cell_count, " cells, run.memory_limit_bytes is ",
                                                   limit));
}

// Points outside of the solid that nothing of the hull is near to.
std::vector<Vec3d> FarOutside(const HullAsker& solid, const std::vector<Vec3d>& points) {
  std::vector<Vec3d> outside;
  if (points.empty()) return outside;
  const std::vector<HullSide> side =
      solid.AskOrThrow(SideOf<PlainPoints>{amhex::PointsOf(points), kNearHull});
  for (size_t i = 0; i < points.size(); ++i) {
    if (side[i] == HullSide::kOutside) outside.push_back(points[i]);
  }
  return outside;
}

// The user's where a start lays its grid of sites along those, or too little is flat.
AxisFrame AxesFor(const TriangleMesh& solid, const MeshingParams& params, const StopPoll& poll) {
  if (params.relaxation.initialization != Initialization::kField) return {};
  const UprightAxes upright = FindUprightAxes(solid, poll);
  const bool is_worth_it = upright.share_along - upright.share_along_world > kWorthTurning;
  return is_worth_it ? upright.axes : AxisFrame{};
}

struct SizedSolid {
  ClosedSurface closed;
  double volume = 0;            // of its frame
  double user_edge_length = 0;  // the user's units
};

absl::StatusOr<SizedSolid> SizeSolid(const InputHull& input, const Frame& unit,
                                     const SizingParams& sizing, DeviceUse& device,
                                     RunContext& run) {
  SizedSolid result;
  AMHEX_ASSIGN_OR_RETURN(result.closed, CloseInput(input, unit, sizing, run));
  const TriangleMesh& solid = result.closed.mesh;
  result.volume = VolumeOf(solid);
  if (!(result.volume > kSmallestVolumeRatio)) {
    return absl::InvalidArgumentError(absl::StrCat("the input encloses no volume: ", result.volume,
                                                   " of its box diagonal cubed"));
  }
  // What was rebuilt for a size keeps that size, so that a rerun with it gets the same surface.
  SizingParams wanted = sizing;
  if (result.closed.user_edge_length > 0 && sizing.cell_count > 0) {
    wanted = {0, result.closed.user_edge_length};
  }
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  AMHEX_ASSIGN_OR_RETURN(
      result.user_edge_length,
      ResolveEdgeLength(wanted, solid, result.volume, unit.scale, StopPoll(run), &device));
  return result;
}

// The points of the hull's frame, of those of the unit frame.
void BringInto(const Frame& frame, double edge_length, std::vector<Vec3d>& points) {
  for (Vec3d& p : points) p = frame.DirectionToNormalized(p) / edge_length;
}

// `unit` with the axes that the hull is to have; `device` may be null.
Hull MakeHull(SizedSolid sized, const Frame& unit, const MeshingParams& params,
              const StopPoll& poll, DeviceUse* device) {
  TriangleMesh& solid = sized.closed.mesh;
  const double h = sized.user_edge_length / unit.scale;
  Hull hull;
  hull.frame = {unit.origin, sized.user_edge_length, unit.axes};
  hull.vertices = std::move(solid.vertices);
  Box3d box;
  for (const Vec3d& p : hull.vertices) box.Extend(p / h);
  hull.input_diagonal = box.Diagonal();
  BringInto(unit, h, hull.vertices);
  hull.triangles = std::move(solid.triangles);
  for (const Vec3d& p : hull.vertices) hull.box.Extend(p);
  hull.volume = sized.volume / (h * h * h);
  hull.warnings = std::move(sized.closed.warnings);
  hull.queries = std::make_shared<const HullQueries>(hull.vertices, hull.triangles, poll, device,
                                                     HullAskers::kDevice);
  const HullAsker asker(*hull.queries, device, poll);
  const TriangleMesh topology{hull.vertices, hull.triangles};
  const EdgeAdjacency adjacency = FindEdgeAdjacency(topology, poll);
  const Components components = FindComponents(adjacency, poll);
  hull.component_count = components.count;
  hull.is_given = sized.closed.user_edge_length == 0;
  hull.genus = adjacency.IsClosedManifold() ? GenusOf(topology, adjacency, components) : -1;
  poll.Now();
  ComputeNormals(adjacency, hull);
  poll.Now();
  FindSharpFeatures(params.input.sharp_angle_degrees, adjacency, asker, hull);
  hull.input_points = std::move(sized.closed.input_points);
  BringInto(unit, h, hull.input_points);
  // What bounds no volume and what was too thin to be rebuilt: no part of the hull, but missed.
  BringInto(unit, h, sized.closed.given_points);
  const std::vector<Vec3d> lost = FarOutside(asker, sized.closed.given_points);
  hull.input_points.insert(hull.input_points.end(), lost.begin(), lost.end());
  if (device != nullptr) hull.device_notes = device->notes();
  return hull;
}

// Of a mesh's triangles or a cloud without strays.
absl::StatusOr<Hull> BuildHullOfSurface(const InputHull& input, const MeshingParams& params,
                                        RunContext& run) {
  Frame unit = UnitFrame(BoxOf(input));
  if (!(unit.scale > 0)) {
    return absl::InvalidArgumentError("the input's triangles are all at one point");
  }
  AMHEX_ASSIGN_OR_RETURN(DeviceUse device, DeviceUse::Choose(params.run.backend));
  SizingParams sizing = params.sizing;
  AMHEX_ASSIGN_OR_RETURN(SizedSolid sized, SizeSolid(input, unit, sizing, device, run));
  const double rebuilt_for = sized.closed.user_edge_length;
  if (rebuilt_for > 0 && sizing.cell_count == 0 && sizing.edge_length == 0) {
    // Only a first surface could tell the default size; the hull is the one made for that size.
    if (std::abs(sized.user_edge_length / rebuilt_for - 1) < kSameSizeRatio) {
      sized.user_edge_length = rebuilt_for;
    } else {
      sizing.edge_length = sized.user_edge_length;
      AMHEX_ASSIGN_OR_RETURN(sized, SizeSolid(input, unit, sizing, device, run));
    }
  }
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  ReportFraction(kClosedFraction, run);

  const double h = sized.user_edge_length / unit.scale;
  AMHEX_RETURN_IF_ERROR(
      CheckMemory(sized.volume / (h * h * h), input, params.run.memory_limit_bytes));
  const int64_t joined =
      MergeNeedles(h, params.input.sharp_angle_degrees, sized.closed.mesh, StopPoll(run));
  if (joined > 0) {
    sized.volume = VolumeOf(sized.closed.mesh);
    sized.closed.warnings.push_back(absl::StrCat(
        "triangles that reach across cells far wider than they are, joined with neighbours: ",
        joined));
  }
  unit.axes = AxesFor(sized.closed.mesh, params, StopPoll(run));
  return MakeHull(std::move(sized), unit, params, StopPoll(run), &device);
}

// `input`: a cloud without so many strays.
absl::StatusOr<Hull> BuildHullWithoutStrays(const InputHull& input, size_t strays,
                                            const MeshingParams& params, RunContext& run) {
  AMHEX_RETURN_IF_ERROR(CheckInput(input));
  AMHEX_ASSIGN_OR_RETURN(Hull hull, BuildHullOfSurface(input, params, run));
  hull.warnings.push_back(absl::StrCat(
      "stray points far out, that made the box at least twice as large, left out: ", strays));
  return hull;
}

}  // namespace

absl::StatusOr<Hull> BuildHull(const InputHull& input, const MeshingParams& params,
                               RunContext& run) {
  AMHEX_RETURN_IF_ERROR(Validate(params));
  AMHEX_RETURN_IF_ERROR(CheckInput(input));
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  if (const auto* volume = std::get_if<VolumeMesh>(&input)) {
    AMHEX_ASSIGN_OR_RETURN(const BrokenVolume broken, BreakDown(*volume, run));
    return BuildHull(BoundaryOf(broken), params, run);
  }
  if (const auto* cloud = std::get_if<PointCloud>(&input)) {
    std::optional<PointCloud> without_strays = DropStrays(*cloud, StopPoll(run));
    if (without_strays.has_value()) {
      const size_t strays = cloud->points.size() - without_strays->points.size();
      return BuildHullWithoutStrays(*std::move(without_strays), strays, params, run);
    }
  }
  return BuildHullOfSurface(input, params, run);
}

absl::StatusOr<Hull> BuildHullOfCells(const TriangleMesh& boundary, double edge_length,
                                      const MeshingParams& params, RunContext& run) {
  const Frame unit = UnitFrame(BoxOf(boundary));
  SizedSolid sized;
  AMHEX_ASSIGN_OR_RETURN(sized.closed, CloseInput(boundary, unit, {}, run));
  if (sized.closed.user_edge_length > 0) {
    return absl::InvalidArgumentError(
        "the boundary of the volume mesh does not bound a solid by itself, so that its cells "
        "cannot "
        "be reassembled; set input.volume_use to HULL to mesh what it encloses");
  }
  sized.volume = VolumeOf(sized.closed.mesh);
  sized.user_edge_length = edge_length;
  return MakeHull(std::move(sized), unit, params, StopPoll(run), nullptr);
}

}  // namespace amhex
