#include "output/mesh_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "input/ask_hull.h"
#include "input/hull_queries.h"
#include "output/boundary_overlap.h"
#include "output/boundary_topology.h"
#include "output/measure_cells.h"
#include "output/mesh_faces.h"
#include "output/sharp_edges.h"
#include "output/surface_distance.h"
#include "topology/primitives.h"

namespace amhex {
namespace {

constexpr double kSurfaceSpacing = 1.0 / 3.0;  // edge lengths
constexpr size_t kMaxInputPoints = 1'000'000;

void SumUpCells(const AtMostHexaMesh& mesh, const StopPoll& poll, DeviceUse* device,
                MeshStatistics& statistics) {
  const std::vector<CellMeasures> measures =
      MeasureCells(mesh.corners, mesh.vertices, poll, device);
  double hexahedra_volume = 0;
  int64_t hexahedra = 0;
  statistics.min_scaled_jacobian = mesh.corners.empty() ? 0.0 : 1.0;
  statistics.min_scaled_jacobian_hexahedra = 1.0;
  for (size_t c = 0; c < mesh.corners.size(); ++c) {
    poll.At(static_cast<int64_t>(c));
    const double volume = measures[c].volume;
    const double quality = mesh.quality[c];
    ++statistics.cells_by_type[static_cast<size_t>(mesh.types[c])];
    statistics.volume += volume;
    statistics.min_scaled_jacobian = std::min(statistics.min_scaled_jacobian, quality);
    statistics.average_scaled_jacobian += quality;
    if (mesh.types[c] != PrimitiveType::kHexahedron) continue;
    ++hexahedra;
    hexahedra_volume += volume;
    statistics.min_scaled_jacobian_hexahedra =
        std::min(statistics.min_scaled_jacobian_hexahedra, quality);
    statistics.average_scaled_jacobian_hexahedra += quality;
  }
  if (statistics.volume > 0) {
    statistics.hexahedra_volume_ratio = hexahedra_volume / statistics.volume;
  }
  if (hexahedra == 0) {
    statistics.min_scaled_jacobian_hexahedra = 0;
  } else {
    statistics.average_scaled_jacobian_hexahedra /= static_cast<double>(hexahedra);
  }
  if (mesh.corners.empty()) return;
  const double cell_count = static_cast<double>(mesh.corners.size());
  statistics.average_scaled_jacobian /= cell_count;
  statistics.hexahedra_ratio = static_cast<double>(hexahedra) / cell_count;
}

double ShortestEdge(const AtMostHexaMesh& mesh, const StopPoll& poll) {
  double squared = std::numeric_limits<double>::infinity();
  for (size_t c = 0; c < mesh.corners.size(); ++c) {
    poll.At(static_cast<int64_t>(c));
    for (const auto& [a, b] : kCubeEdges) {
      const int32_t from = mesh.corners[c][a], to = mesh.corners[c][b];
      if (from != to)
        squared = std::min(squared, SquaredNorm(mesh.vertices[to] - mesh.vertices[from]));
    }
  }
  return mesh.corners.empty() ? 0 : std::sqrt(squared);
}

// The input's own points, thinned evenly where there are very many.
std::vector<Vec3d> InputSamples(const Hull& hull) {
  std::vector<Vec3d> samples = SampleSurface(hull.vertices, hull.triangles, kSurfaceSpacing);
  const size_t stride = 1 + hull.input_points.size() / kMaxInputPoints;
  for (size_t i = 0; i < hull.input_points.size(); i += stride) {
    samples.push_back(hull.input_points[i]);
  }
  return samples;
}

std::vector<Vec3d> MeshSamples(const BoundaryTriangles& boundary) {
  std::vector<Vec3d> samples =
      SampleSurface(boundary.vertices, boundary.triangles, kSurfaceSpacing);
  samples.insert(samples.end(), boundary.vertices.begin(), boundary.vertices.end());
  return samples;
}

HullQueries QueriesOf(const BoundaryTriangles& boundary, const StopPoll& poll, DeviceUse* device) {
  return {boundary.vertices,   boundary.triangles,       poll, device,
          HullAskers::kDevice, HullQuestions::kDistances};
}

bool HasDistances(const BoundaryTriangles& boundary, const Hull& hull) {
  return !boundary.triangles.empty() && hull.queries != nullptr && hull.input_diagonal > 0;
}

// In the hull's normalised frame.
BoundaryTriangles NormalizedBoundary(const FaceCensus& census, const AtMostHexaMesh& mesh,
                                     const Hull& hull) {
  BoundaryTriangles boundary = TriangulateBoundary(census.boundary, mesh.vertices);
  for (Vec3d& p : boundary.vertices) p = hull.frame.ToNormalized(p);
  return boundary;
}

// `boundary` in the hull's normalised frame.
void MeasureDistances(const BoundaryTriangles& boundary, const Hull& hull, const StopPoll& poll,
                      DeviceUse* device, MeshStatistics& statistics) {
  const double diagonal = hull.input_diagonal;
  if (!HasDistances(boundary, hull)) return;
  const DistanceSummary to_input =
      DistanceToSurface(MeshSamples(boundary), HullAsker(*hull.queries, device, poll));
  const HullQueries mesh_queries = QueriesOf(boundary, poll, device);
  const DistanceSummary to_mesh =
      DistanceToSurface(InputSamples(hull), HullAsker(mesh_queries, device, poll));
  statistics.mesh_to_input_max = to_input.maximum / diagonal;
  statistics.input_to_mesh_max = to_mesh.maximum / diagonal;
  statistics.input_to_mesh_mean = to_mesh.mean / diagonal;
  // The frame's unit is the wanted edge length.
  statistics.distance_exceeds_cell = std::max(to_input.maximum, to_mesh.maximum) > 1.0;
}

}  // namespace

MeshStatistics MeasureMesh(const AtMostHexaMesh& mesh, const Hull& hull, const StopPoll& poll,
                           DeviceUse* device) {
  MeshStatistics statistics;
  statistics.cell_count = static_cast<int64_t>(mesh.corners.size());
  statistics.vertex_count = static_cast<int64_t>(mesh.vertices.size());
  SumUpCells(mesh, poll, device, statistics);
  const double scale = hull.frame.scale;
  statistics.edge_length = scale;
  statistics.shortest_edge = ShortestEdge(mesh, poll);
  statistics.hull_volume = hull.volume * scale * scale * scale;

  const FaceCensus census = CountFaces(mesh.corners, statistics.vertex_count, poll);
  statistics.boundary_face_count = static_cast<int64_t>(census.boundary.size());
  const BoundaryTopology topology = ExamineBoundary(census.boundary, mesh.vertices, poll);
  statistics.boundary_component_count = topology.component_count;
  statistics.genus = topology.genus;

  MeasureDistances(NormalizedBoundary(census, mesh, hull), hull, poll, device, statistics);
  std::vector<Vec3d> vertices = mesh.vertices;
  for (Vec3d& p : vertices) p = hull.frame.ToNormalized(p);
  const SharpEdgeDeviation deviation = MeasureSharpEdges(hull, census.boundary, vertices, poll);
  statistics.sharp_edge_deviation_rms = deviation.root_mean_square;
  statistics.sharp_edge_deviation_max = deviation.maximum;
  return statistics;
}

BoundaryMeasures MeasureBoundary(const AtMostHexaMesh& mesh, const Hull& hull, double enough,
                                 const StopPoll& poll, DeviceUse* device) {
  const FaceCensus census =
      CountFaces(mesh.corners, static_cast<int64_t>(mesh.vertices.size()), poll);
  const BoundaryTopology topology = ExamineBoundary(census.boundary, mesh.vertices, poll);
  BoundaryMeasures measures{topology.component_count, topology.genus, 0};
  const BoundaryTriangles boundary = NormalizedBoundary(census, mesh, hull);
  if (!HasDistances(boundary, hull)) return measures;
  const HullQueries mesh_queries = QueriesOf(boundary, poll, device);
  measures.farthest = std::max(
      FarthestFromSurface(MeshSamples(boundary), enough, HullAsker(*hull.queries, device, poll)),
      FarthestFromSurface(InputSamples(hull), enough, HullAsker(mesh_queries, device, poll)));
  return measures;
}

}  // namespace amhex
