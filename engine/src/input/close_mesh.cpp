#include "input/close_mesh.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "input/cap_openings.h"
#include "input/clean_mesh.h"
#include "input/embedding_check.h"
#include "input/hull_queries.h"
#include "input/orient_components.h"
#include "input/rebuild_surface.h"
#include "input/repeated_components.h"
#include "input/surface_topology.h"
#include "input/warn_of.h"

namespace amhex {
namespace {

// Vertices of one point written with rounding errors lie this near; units of the box diagonal.
constexpr double kRoundingDistance = 1e-7;
// Up to this share of the area may be misbounded: small folds that every stage survives.
constexpr double kTolerableMisboundedRatio = 0.005;
// If more than this share of the area belongs to pieces that enclose nothing by themselves, the
// surface is in shreds.
constexpr double kShreddedAreaRatio = 0.01;
constexpr char kComponentsTurned[] = "components turned to look outward";

struct CleanSurface {
  EdgeAdjacency adjacency;
  int64_t loose_sheets = 0;  // left out
};

// Joins vertices only as far as that is needed for a closed surface.
CleanSurface CleanUntilClosed(TriangleMesh& mesh, std::vector<std::string>& warnings,
                              const StopPoll& poll) {
  WarnOf(DropUnusedVertices(mesh, poll), "vertices that no triangle uses, left out", warnings);
  CleanCounts counts = DropEmptyAndRepeatedTriangles(mesh, poll);
  EdgeAdjacency adjacency = FindEdgeAdjacency(mesh, poll);
  for (const double tolerance : {0.0, kRoundingDistance}) {
    if (adjacency.IsClosedManifold()) break;
    const CleanCounts more = MergeVertices(tolerance, mesh, poll);
    DropUnusedVertices(mesh, poll);
    counts.merged_vertices += more.merged_vertices;
    counts.empty_triangles += more.empty_triangles;
    counts.repeated_triangles += more.repeated_triangles;
    adjacency = FindEdgeAdjacency(mesh, poll);
  }
  WarnOf(counts.merged_vertices, "vertices at the same place, joined", warnings);
  WarnOf(counts.empty_triangles, "triangles without area, left out", warnings);
  WarnOf(counts.repeated_triangles, "triangles given more than once, used once", warnings);
  int64_t dropped = 0;
  if (adjacency.non_manifold_edge_count > 0) {
    dropped = DropLooseSheets(adjacency, mesh);
    WarnOf(dropped, "loose sheets on the surface, left out", warnings);
    if (dropped > 0) adjacency = FindEdgeAdjacency(mesh);
  }
  return {std::move(adjacency), dropped};
}

// Returns the number of openings.
absl::StatusOr<size_t> CapAll(RunContext& run, TriangleMesh& mesh) {
  const auto loops = FindOpenings(FindEdgeAdjacency(mesh), mesh);
  AMHEX_RETURN_IF_ERROR(CapOpenings(loops, run, mesh));
  return loops.size();
}

struct KeptTriangles {
  bool bound_a_solid = false;          // else the surface cannot be kept as it is
  bool are_all = true;                 // none belonged to what bounds no volume
  bool has_turned_components = false;  // and said so
};

// Caps, orients and checks.
absl::StatusOr<KeptTriangles> KeepTriangles(TriangleMesh& mesh, std::vector<std::string>& warnings,
                                            RunContext& run) {
  const StopPoll poll(run);
  CleanSurface clean = CleanUntilClosed(mesh, warnings, poll);
  EdgeAdjacency& adjacency = clean.adjacency;
  if (mesh.triangles.empty()) {
    return absl::InvalidArgumentError("the input's triangles all have no area");
  }
  if (adjacency.non_manifold_edge_count > 0) {
    WarnOf(adjacency.non_manifold_edge_count, "edges with more than two triangles", warnings);
    return KeptTriangles();
  }
  Components components = FindComponents(adjacency, poll);
  const int64_t repeated = DropRepeatedComponents(components, mesh, poll);
  if (repeated > 0) {
    WarnOf(repeated, "parts given more than once, used once", warnings);
    adjacency = FindEdgeAdjacency(mesh, poll);
    components = FindComponents(adjacency, poll);
  }
  const OrientationResult orientation =
      MakeOrientationConsistent(adjacency, components, mesh, poll);
  if (!orientation.is_orientable) {
    warnings.push_back("the surface has only one side somewhere");
    return KeptTriangles();
  }
  WarnOf(orientation.turned_count, "triangles turned to agree with their neighbours", warnings);
  // Turned triangles have their edges in another order.
  adjacency = FindEdgeAdjacency(mesh, poll);
  SplitFans(adjacency, mesh, poll);
  size_t openings = 0;
  if (adjacency.open_edge_count > 0) {
    AMHEX_ASSIGN_OR_RETURN(openings, CapAll(run, mesh));
    adjacency = FindEdgeAdjacency(mesh, poll);
    if (!adjacency.IsClosedManifold()) return KeptTriangles();
    // Patches come last and touch one component each: the old ones keep their numbers.
    components = FindComponents(adjacency, poll);
  }
  const ComponentDecision decision = OrientComponents(orientation, mesh, components);
  poll.Now();
  if (decision.components_cut || decision.dropped_flat_area_ratio > kShreddedAreaRatio) {
    return KeptTriangles();
  }
  if (openings > 0) {
    warnings.push_back(absl::StrCat("the input has ", openings,
                                    openings == 1 ? " opening" : " openings",
                                    ", closed by the engine"));
  }
  WarnOf(decision.turned_components, kComponentsTurned, warnings);
  WarnOf(decision.dropped_components, "components that bound no volume, left out", warnings);
  DropUnusedVertices(mesh, poll);
  if (mesh.triangles.empty()) return absl::InvalidArgumentError("the input encloses no volume");
  const HullQueries queries(mesh.vertices, mesh.triangles, poll);
  return KeptTriangles{MisboundedAreaRatio(mesh, queries, poll) <= kTolerableMisboundedRatio,
                       clean.loose_sheets + decision.dropped_components == 0,
                       decision.turned_components > 0};
}

}  // namespace

absl::StatusOr<ClosedSurface> CloseMesh(TriangleMesh mesh, const WantedSize& wanted,
                                        RunContext& run) {
  ClosedSurface surface;
  surface.mesh = mesh;
  AMHEX_ASSIGN_OR_RETURN(const KeptTriangles kept,
                         KeepTriangles(surface.mesh, surface.warnings, run));
  const StopPoll poll(run);
  if (kept.bound_a_solid) {
    surface.input_points = surface.mesh.vertices;
    if (!kept.are_all) {
      DropUnusedVertices(mesh, poll);
      surface.given_points = std::move(mesh.vertices);
    }
    return surface;
  }
  DropUnusedVertices(mesh, poll);
  surface.given_points = mesh.vertices;

  // The soup as oriented as it can be; patches that closed nothing are not part of it.
  std::vector<std::string> ignored;
  const EdgeAdjacency adjacency = CleanUntilClosed(mesh, ignored, poll).adjacency;
  const Components components = FindComponents(adjacency, poll);
  const OrientationResult orientation =
      MakeOrientationConsistent(adjacency, components, mesh, poll);
  if (orientation.is_orientable) {
    poll.Now();
    const int64_t turned = TurnClosedComponents(orientation, adjacency, components, mesh);
    if (!kept.has_turned_components) WarnOf(turned, kComponentsTurned, surface.warnings);
  }
  DropUnusedVertices(mesh, poll);
  AMHEX_ASSIGN_OR_RETURN(ClosedSurface rebuilt, RebuildFromSoup(mesh, wanted, run));
  surface.warnings.push_back(
      "the surface does not bound a solid by itself; rebuilt where its winding number is one half");
  surface.warnings.insert(surface.warnings.end(), rebuilt.warnings.begin(), rebuilt.warnings.end());
  surface.mesh = std::move(rebuilt.mesh);
  surface.input_points = std::move(rebuilt.input_points);
  surface.user_edge_length = rebuilt.user_edge_length;
  return surface;
}

}  // namespace amhex
