#include "output/boundary_overlap.h"

#include <algorithm>
#include <cmath>

#include "input/ask_hull.h"
#include "input/hull_queries.h"
#include "output/boundary_topology.h"

namespace amhex {
namespace {

constexpr int64_t kMaxCellSamples = 20'000;
constexpr int64_t kMaxBoundarySamples = 200'000;
// A second covering changes the winding number by 1; dipoles err by a few hundredths.
constexpr double kWindingTolerance = 0.25;
// Distance of the samples from a face or edge, in fractions of the face's mean edge or the edge.
constexpr double kOffset = 1e-3;
// Two faces that fold back on each other around an edge leave no direction that is plainly outside;
// such slits are the boundary's topology to find.
constexpr double kLeastBisector = 0.05;

// Every stride-th of `count` items, at most about `limit` of them.
struct Selection {
  int64_t stride = 1;
  int64_t count = 0;
  Selection(int64_t item_count, int64_t limit)
      : stride(std::max<int64_t>(1, (item_count + limit - 1) / limit)),
        count((item_count + stride - 1) / stride) {}
};

// Whether the boundary winds around a sample otherwise than it should.
bool IsWrong(double winding_error) { return !(winding_error <= kWindingTolerance); }

std::vector<double> WindingNumbers(const std::vector<Vec3d>& points, const HullAsker& surface) {
  return surface.AskOrThrow(WindingAround<PlainPoints>{PointsOf(points)});
}

Vec3d MapCentre(const CellCorners& corners, const std::vector<Vec3d>& vertices) {
  Vec3d centre;
  for (const int32_t v : corners) centre += vertices[v];
  return centre / 8.0;
}

}  // namespace

BoundaryTriangles TriangulateBoundary(const std::vector<BoundaryFace>& boundary,
                                      const std::vector<Vec3d>& vertices) {
  BoundaryTriangles result;
  std::vector<int32_t> local(vertices.size(), -1);
  const auto local_id = [&](int32_t v) {
    if (local[v] < 0) {
      local[v] = static_cast<int32_t>(result.vertices.size());
      result.vertices.push_back(vertices[v]);
    }
    return local[v];
  };
  for (const BoundaryFace& b : boundary) {
    std::array<int32_t, 4> ring{};
    for (int j = 0; j < b.face.count; ++j) ring[j] = local_id(b.face.v[j]);
    if (b.face.count == 3) {
      result.triangles.push_back({ring[0], ring[1], ring[2]});
      continue;
    }
    const int32_t centre = static_cast<int32_t>(result.vertices.size());
    result.vertices.push_back(FaceCentre(b.face, vertices));
    for (int j = 0; j < 4; ++j) {
      result.triangles.push_back({ring[j], ring[(j + 1) % 4], centre});
    }
  }
  return result;
}

namespace {

// A directed edge of a boundary face and the unit normal of the surface triangle at it.
struct BoundaryEdge {
  int32_t low = 0, high = 0;
  Vec3d normal;
};

// Both uses of every edge, next to each other.
std::vector<BoundaryEdge> PairedEdges(const std::vector<BoundaryFace>& boundary,
                                      const std::vector<Vec3d>& vertices) {
  std::vector<BoundaryEdge> edges;
  edges.reserve(boundary.size() * 4);
  for (const BoundaryFace& b : boundary) {
    const OutwardFace& face = b.face;
    const Vec3d centre = FaceCentre(face, vertices);
    for (int j = 0; j < face.count; ++j) {
      const int32_t from = face.v[j], to = face.v[(j + 1) % face.count];
      const Vec3d& start = vertices[from];
      const Vec3d normal = Normalized(Cross(vertices[to] - start, centre - start));
      edges.push_back({std::min(from, to), std::max(from, to), normal});
    }
  }
  std::stable_sort(edges.begin(), edges.end(), [](const BoundaryEdge& a, const BoundaryEdge& b) {
    return a.low != b.low ? a.low < b.low : a.high < b.high;
  });
  return edges;
}

void MeasureCellOverlap(const std::vector<CellCorners>& cells, const std::vector<Vec3d>& vertices,
                        const HullAsker& surface, OverlapReport& report) {
  const Selection selection(static_cast<int64_t>(cells.size()), kMaxCellSamples);
  std::vector<Vec3d> centres;
  for (int64_t i = 0; i < selection.count; ++i) {
    centres.push_back(MapCentre(cells[i * selection.stride], vertices));
  }
  report.cell_samples = selection.count;
  for (const double winding : WindingNumbers(centres, surface)) {
    const double error = std::abs(winding - 1);
    if (IsWrong(error)) ++report.overlapped_cells;
    report.worst_cell_winding_error = std::max(report.worst_cell_winding_error, error);
  }
}

void MeasureFaceOverlap(const std::vector<BoundaryFace>& boundary,
                        const std::vector<Vec3d>& vertices, const HullAsker& surface,
                        OverlapReport& report) {
  const Selection selection(static_cast<int64_t>(boundary.size()), kMaxBoundarySamples);
  std::vector<Vec3d> inside_and_outside;
  for (int64_t i = 0; i < selection.count; ++i) {
    const OutwardFace& face = boundary[i * selection.stride].face;
    const Vec3d centre = FaceCentre(face, vertices);
    const Vec3d area = AreaVector(face, vertices);
    const Vec3d offset = Normalized(area) * (kOffset * std::sqrt(Norm(area)));
    inside_and_outside.push_back(centre - offset);
    inside_and_outside.push_back(centre + offset);
  }
  const std::vector<double> winding = WindingNumbers(inside_and_outside, surface);
  report.face_samples = selection.count;
  for (size_t i = 0; i < winding.size(); i += 2) {
    if (IsWrong(std::abs(winding[i] - 1)) || IsWrong(std::abs(winding[i + 1]))) {
      ++report.overlapped_faces;
    }
  }
}

void MeasureEdgeOverlap(const std::vector<BoundaryFace>& boundary,
                        const std::vector<Vec3d>& vertices, const HullAsker& surface,
                        OverlapReport& report) {
  const std::vector<BoundaryEdge> edges = PairedEdges(boundary, vertices);
  const Selection selection(static_cast<int64_t>(edges.size() / 2), kMaxBoundarySamples);
  std::vector<Vec3d> outside;
  for (int64_t i = 0; i < selection.count; ++i) {
    const auto e = static_cast<size_t>(2 * i * selection.stride);
    const BoundaryEdge& edge = edges[e];
    const Vec3d bisector = edge.normal + edges[e + 1].normal;
    if (Norm(bisector) < kLeastBisector) continue;
    const Vec3d &a = vertices[edge.low], &b = vertices[edge.high];
    outside.push_back((a + b) / 2.0 + Normalized(bisector) * (kOffset * Norm(b - a)));
  }
  report.edge_samples = selection.count;
  for (const double winding : WindingNumbers(outside, surface)) {
    if (IsWrong(std::abs(winding))) ++report.overlapped_edges;
  }
}

}  // namespace

OverlapReport MeasureOverlap(const std::vector<CellCorners>& cells,
                             const std::vector<BoundaryFace>& boundary,
                             const std::vector<Vec3d>& vertices, const StopPoll& poll,
                             DeviceUse* device) {
  OverlapReport report;
  const BoundaryTriangles surface = TriangulateBoundary(boundary, vertices);
  const HullQueries queries(surface.vertices, surface.triangles, poll, device, HullAskers::kDevice);
  const HullAsker asker(queries, device, poll);
  MeasureCellOverlap(cells, vertices, asker, report);
  MeasureFaceOverlap(boundary, vertices, asker, report);
  MeasureEdgeOverlap(boundary, vertices, asker, report);
  return report;
}

}  // namespace amhex
