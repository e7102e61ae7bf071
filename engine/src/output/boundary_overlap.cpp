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

constexpr int64_t kMaxSamples = 20000;
// A second covering changes the winding number by 1; dipoles err by a few hundredths.
constexpr double kWindingTolerance = 0.25;
// Distance of the samples from a face, in fractions of its mean edge.
constexpr double kFaceOffset = 1e-3;

struct Tally {
  int64_t failures = 0;
  double worst = 0;
  static Tally Joined(const Tally& a, const Tally& b) {
    return {a.failures + b.failures, std::max(a.worst, b.worst)};
  }
};

// Sums `winding_error(i)` over every stride-th index; counts errors beyond the tolerance.
Tally TallySamples(int64_t sample_count, int64_t stride,
                   const std::function<double(int64_t)>& winding_error) {
  return tbb::parallel_reduce(
      tbb::blocked_range<int64_t>(0, sample_count, 256), Tally{},
      [&](const tbb::blocked_range<int64_t>& range, Tally tally) {
        for (int64_t i = range.begin(); i < range.end(); ++i) {
          const double error = winding_error(i * stride);
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

OverlapReport MeasureOverlap(const std::vector<CellCorners>& cells,
                             const std::vector<BoundaryFace>& boundary,
                             const std::vector<Vec3d>& vertices) {
  OverlapReport report;
  const BoundaryTriangles surface = TriangulateBoundary(boundary, vertices);
  const HullQueries queries(surface.vertices, surface.triangles);

  const int64_t cell_count = static_cast<int64_t>(cells.size());
  const int64_t cell_stride = std::max<int64_t>(1, (cell_count + kMaxSamples - 1) / kMaxSamples);
  report.cell_samples = (cell_count + cell_stride - 1) / cell_stride;
  const Tally cell_tally = TallySamples(report.cell_samples, cell_stride, [&](int64_t c) {
    return std::abs(queries.WindingNumber(MapCentre(cells[c], vertices)) - 1);
  });
  report.overlapped_cells = cell_tally.failures;
  report.worst_cell_winding_error = cell_tally.worst;

  const int64_t face_count = static_cast<int64_t>(boundary.size());
  const int64_t face_stride = std::max<int64_t>(1, (face_count + kMaxSamples - 1) / kMaxSamples);
  report.face_samples = (face_count + face_stride - 1) / face_stride;
  const Tally face_tally = TallySamples(report.face_samples, face_stride, [&](int64_t f) {
    const OutwardFace& face = boundary[f].face;
    const Vec3d centre = FaceCentre(face, vertices);
    const Vec3d area = AreaVector(face, vertices);
    const Vec3d offset = Normalized(area) * (kFaceOffset * std::sqrt(Norm(area)));
    return std::max(std::abs(queries.WindingNumber(centre - offset) - 1),
                    std::abs(queries.WindingNumber(centre + offset)));
  });
  report.overlapped_faces = face_tally.failures;
  return report;
}

}  // namespace amhex
