#include "distance/hull_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <variant>

#include "absl/strings/str_cat.h"
#include "cells/boundary.h"
#include "distance/triangle_tree.h"
#include "formats/hull_reader.h"
#include "formats/status_macros.h"
#include "formats/volume_reader.h"

namespace amhex::client {
namespace {

// Finer samples than the cells' edges, so that no face goes without.
constexpr double kSamplesPerEdge = 2.0;
// Coarser ones where there would be more: seconds, not hours, for a file that is not the one that
// was meshed.
constexpr double kMostSamples = 8e6;

// The hull as triangles that know their cells.
struct CellHull {
  TriangleMesh triangles;
  std::vector<int32_t> cells;  // [triangle_count]
  double mean_edge = 0;
};

Vec3d MiddleOf(const Face& face, const std::vector<Vec3d>& vertices) {
  Vec3d sum;
  for (int i = 0; i < face.count; ++i) sum += vertices[face.vertex[i]];
  return sum / static_cast<double>(face.count);
}

CellHull HullOfCells(const AtMostHexaMesh& mesh, const std::vector<BoundaryFace>& boundary) {
  CellHull hull;
  hull.triangles.vertices = mesh.vertices;
  double edge_sum = 0, edge_count = 0;
  const auto add = [&hull](int32_t a, int32_t b, int32_t c, int32_t cell) {
    hull.triangles.triangles.push_back({a, b, c});
    hull.cells.push_back(cell);
  };
  for (const BoundaryFace& b : boundary) {
    const Face& face = b.face;
    const auto middle = static_cast<int32_t>(hull.triangles.vertices.size());
    if (face.count == 4) hull.triangles.vertices.push_back(MiddleOf(face, mesh.vertices));
    for (int i = 0; i < face.count; ++i) {
      const int32_t from = face.vertex[i], to = face.vertex[(i + 1) % face.count];
      edge_sum += Norm(mesh.vertices[from] - mesh.vertices[to]);
      edge_count += 1;
      if (face.count == 4) add(from, to, middle, b.cell);
    }
    if (face.count == 3) add(face.vertex[0], face.vertex[1], face.vertex[2], b.cell);
  }
  hull.mean_edge = edge_count > 0 ? edge_sum / edge_count : 0;
  return hull;
}

// Keeps the largest distance of each cell.
class Record {
 public:
  explicit Record(size_t cell_count)
      : largest_(cell_count, std::numeric_limits<float>::quiet_NaN()) {}

  void Add(int32_t cell, double distance) {
    const auto value = static_cast<float>(distance);
    if (!(largest_[cell] >= value)) largest_[cell] = value;
    largest_of_all_ = std::max(largest_of_all_, distance);
  }

  // Refuses what cannot be the same body.
  absl::StatusOr<std::vector<float>> Take(double diagonal) {
    if (largest_of_all_ <= diagonal) return std::move(largest_);
    return absl::InvalidArgumentError(absl::StrCat(
        "lies ", largest_of_all_, " from the mesh, which is more than the mesh's diagonal of ",
        diagonal, "; is it what was meshed, in the same unit?"));
  }

 private:
  std::vector<float> largest_;
  double largest_of_all_ = 0;
};

absl::Status CheckPoints(const std::vector<Vec3d>& points) {
  for (size_t i = 0; i < points.size(); ++i) {
    if (std::isfinite(SquaredNorm(points[i]))) continue;
    return absl::InvalidArgumentError(absl::StrCat("point ", i, " is not finite or too far away"));
  }
  return absl::OkStatus();
}

// Calls `visit` with points of the triangle that are nowhere further apart than `spacing` in rows
// along its longest side, and rows no further apart either.
template <class Visit>
void SampleTriangle(std::array<Vec3d, 3> corner, double spacing, const Visit& visit) {
  while (Norm(corner[1] - corner[0]) <
         std::max(Norm(corner[2] - corner[1]), Norm(corner[0] - corner[2]))) {
    std::rotate(corner.begin(), corner.begin() + 1, corner.end());
  }
  const Vec3d base = corner[1] - corner[0];
  const double length = Norm(base);
  const double height = length > 0 ? Norm(Cross(base, corner[2] - corner[0])) / length : 0;
  const auto steps = [spacing](double way) {
    return spacing > 0 ? std::max(1.0, std::ceil(way / spacing)) : 1.0;
  };
  const double rows = steps(height);
  for (double row = 0; row <= rows; ++row) {
    const Vec3d from = corner[0] + (corner[2] - corner[0]) * (row / rows);
    const Vec3d along = base * (1 - row / rows);
    const double places = row < rows ? steps(Norm(along)) : 0;
    for (double place = 0; place <= places; ++place) {
      visit(places > 0 ? from + along * (place / places) : from);
    }
  }
}

// What keeps samples apart by half an edge, and their number within bounds: a triangle takes as
// many as its area and its longest side ask for.
double SpacingOf(const TriangleMesh& surface, double mean_edge) {
  double area = 0, length = 0;
  for (const auto& [a, b, c] : surface.triangles) {
    const Vec3d u = surface.vertices[b] - surface.vertices[a];
    const Vec3d v = surface.vertices[c] - surface.vertices[a];
    area += Norm(Cross(u, v)) / 2;
    length += std::max({Norm(u), Norm(v), Norm(u - v)});
  }
  return std::max(
      {mean_edge / kSamplesPerEdge, std::sqrt(area / kMostSamples), length / kMostSamples});
}

void MeasureFaces(const AtMostHexaMesh& mesh, const std::vector<BoundaryFace>& boundary,
                  const TriangleTree& input, Record* record) {
  for (const BoundaryFace& b : boundary) {
    const Face& face = b.face;
    record->Add(b.cell, input.Find(MiddleOf(face, mesh.vertices)).distance);
    for (int i = 0; i < face.count; ++i) {
      const Vec3d& from = mesh.vertices[face.vertex[i]];
      const Vec3d& to = mesh.vertices[face.vertex[(i + 1) % face.count]];
      record->Add(b.cell, input.Find(from).distance);
      record->Add(b.cell, input.Find((from + to) / 2.0).distance);
    }
  }
}

}  // namespace

TriangleMesh HullOfVolume(const VolumeMesh& volume) {
  struct Use {
    size_t begin = 0, count = 0;
    int uses = 0;
  };
  std::map<std::vector<int32_t>, Use> faces;
  size_t begin = 0;
  for (int32_t count : volume.face_corners) {
    const auto first = volume.corners.begin() + static_cast<std::ptrdiff_t>(begin);
    std::vector<int32_t> key(first, first + count);
    std::sort(key.begin(), key.end());
    Use& use = faces[std::move(key)];
    if (use.uses++ == 0) use.begin = begin, use.count = static_cast<size_t>(count);
    begin += static_cast<size_t>(count);
  }
  TriangleMesh hull;
  hull.vertices = volume.vertices;
  for (const auto& [key, use] : faces) {
    for (size_t i = 2; use.uses == 1 && i < use.count; ++i) {
      hull.triangles.push_back({volume.corners[use.begin], volume.corners[use.begin + i - 1],
                                volume.corners[use.begin + i]});
    }
  }
  return hull;
}

absl::StatusOr<std::vector<float>> DistancesToInput(const AtMostHexaMesh& mesh,
                                                    const InputHull& input) {
  AMHEX_ASSIGN_OR_RETURN(const std::vector<BoundaryFace> boundary, BoundaryOf(mesh, {}));
  const CellHull hull = HullOfCells(mesh, boundary);
  if (hull.cells.empty()) return absl::InvalidArgumentError("the mesh has no cells");
  Box3d box;
  for (const Vec3d& vertex : hull.triangles.vertices) box.Extend(vertex);
  const TriangleTree tree(hull.triangles);
  Record record(mesh.corners.size());
  const auto measure = [&](const Vec3d& point) {
    const TriangleTree::Closest closest = tree.Find(point);
    record.Add(hull.cells[closest.triangle], closest.distance);
  };
  if (const auto* cloud = std::get_if<PointCloud>(&input)) {
    if (cloud->points.empty()) return absl::InvalidArgumentError("the cloud has no points");
    AMHEX_RETURN_IF_ERROR(CheckPoints(cloud->points));
    for (const Vec3d& point : cloud->points) measure(point);
    return record.Take(box.Diagonal());
  }
  const auto* volume = std::get_if<VolumeMesh>(&input);
  const TriangleMesh surface =
      volume != nullptr ? HullOfVolume(*volume) : std::get<TriangleMesh>(input);
  if (surface.triangles.empty()) return absl::InvalidArgumentError("the input has no triangles");
  AMHEX_RETURN_IF_ERROR(CheckPoints(surface.vertices));
  const double spacing = SpacingOf(surface, hull.mean_edge);
  for (const auto& [a, b, c] : surface.triangles) {
    SampleTriangle({surface.vertices[a], surface.vertices[b], surface.vertices[c]}, spacing,
                   measure);
  }
  MeasureFaces(mesh, boundary, TriangleTree(surface), &record);
  return record.Take(box.Diagonal());
}

absl::StatusOr<std::vector<float>> DistancesToFile(const AtMostHexaMesh& mesh,
                                                   const std::string& path) {
  InputHull input;
  if (VolumeFormatOfPath(path)) {
    AMHEX_ASSIGN_OR_RETURN(input, ReadVolumeFile(path));
  } else {
    AMHEX_ASSIGN_OR_RETURN(input, ReadHullFile(path));
  }
  absl::StatusOr<std::vector<float>> distances = DistancesToInput(mesh, input);
  if (distances.ok()) return distances;
  return absl::Status(distances.status().code(),
                      absl::StrCat(path, ": ", std::string(distances.status().message())));
}

}  // namespace amhex::client
