#include "output/boundary_overlap.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <functional>

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

struct Tally {
  int64_t failures = 0;
  double worst = 0;
  static Tally Joined(const Tally& a, const Tally& b) {
    return {a.failures + b.failures, std::max(a.worst, b.worst)};
  }
};

// Every stride-th of `count` items, at most about `limit` of them.
struct Selection {
  int64_t stride = 1;
  int64_t count = 0;
  Selection(int64_t item_count, int64_t limit)
      : stride(std::max<int64_t>(1, (item_count + limit - 1) / limit)),
        count((item_count + stride - 1) / stride) {}
};

// Counts the selected items whose winding error exceeds the tolerance.
Tally TallySamples(const Selection& selection, const StopPoll& poll,
                   const std::function<double(int64_t)>& winding_error) {
  return tbb::parallel_reduce(
      tbb::blocked_range<int64_t>(0, selection.count, 256), Tally{},
      [&](const tbb::blocked_range<int64_t>& range, Tally tally) {
        poll.Now();
        for (int64_t i = range.begin(); i < range.end(); ++i) {
          const double error = winding_error(i * selection.stride);
          if (!(error <= kWindingTolerance)) ++tally.failures;
          tally.worst = std::max(tally.worst, error);
        }
        return tally;
      },
      &Tally::Joined);
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
                        const HullQueries& queries, const StopPoll& poll, OverlapReport& report) {
  const Selection selection(static_cast<int64_t>(cells.size()), kMaxCellSamples);
  const Tally tally = TallySamples(selection, poll, [&](int64_t c) {
    return std::abs(queries.WindingNumber(MapCentre(cells[c], vertices)) - 1);
  });
  report.cell_samples = selection.count;
  report.overlapped_cells = tally.failures;
  report.worst_cell_winding_error = tally.worst;
}

void MeasureFaceOverlap(const std::vector<BoundaryFace>& boundary,
                        const std::vector<Vec3d>& vertices, const HullQueries& queries,
                        const StopPoll& poll, OverlapReport& report) {
  const Selection selection(static_cast<int64_t>(boundary.size()), kMaxBoundarySamples);
  const Tally tally = TallySamples(selection, poll, [&](int64_t f) {
    const OutwardFace& face = boundary[f].face;
    const Vec3d centre = FaceCentre(face, vertices);
    const Vec3d area = AreaVector(face, vertices);
    const Vec3d offset = Normalized(area) * (kOffset * std::sqrt(Norm(area)));
    return std::max(std::abs(queries.WindingNumber(centre - offset) - 1),
                    std::abs(queries.WindingNumber(centre + offset)));
  });
  report.face_samples = selection.count;
  report.overlapped_faces = tally.failures;
}

void MeasureEdgeOverlap(const std::vector<BoundaryFace>& boundary,
                        const std::vector<Vec3d>& vertices, const HullQueries& queries,
                        const StopPoll& poll, OverlapReport& report) {
  const std::vector<BoundaryEdge> edges = PairedEdges(boundary, vertices);
  const Selection selection(static_cast<int64_t>(edges.size() / 2), kMaxBoundarySamples);
  const Tally tally = TallySamples(selection, poll, [&](int64_t e) {
    const BoundaryEdge& edge = edges[2 * e];
    const Vec3d bisector = edge.normal + edges[2 * e + 1].normal;
    if (Norm(bisector) < kLeastBisector) return 0.0;
    const Vec3d &a = vertices[edge.low], &b = vertices[edge.high];
    const Vec3d outside = (a + b) / 2.0 + Normalized(bisector) * (kOffset * Norm(b - a));
    return std::abs(queries.WindingNumber(outside));
  });
  report.edge_samples = selection.count;
  report.overlapped_edges = tally.failures;
}

}  // namespace

OverlapReport MeasureOverlap(const std::vector<CellCorners>& cells,
                             const std::vector<BoundaryFace>& boundary,
                             const std::vector<Vec3d>& vertices, const StopPoll& poll) {
  OverlapReport report;
  const BoundaryTriangles surface = TriangulateBoundary(boundary, vertices);
  const HullQueries queries(surface.vertices, surface.triangles, poll);
  MeasureCellOverlap(cells, vertices, queries, poll, report);
  MeasureFaceOverlap(boundary, vertices, queries, poll, report);
  MeasureEdgeOverlap(boundary, vertices, queries, poll, report);
  return report;
}

}  // namespace amhex
