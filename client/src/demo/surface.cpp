#include "demo/surface.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "absl/strings/str_cat.h"
#include "formats/hull_builder.h"

namespace amhex::client {
namespace {

constexpr int kLeastResolution = 8, kMostResolution = 400;
constexpr int kMostAttempts = 8;

// Nodes x fastest, z slowest; cell (i, j, k) has node (i, j, k) as its lowest.
class Grid {
 public:
  Grid(const Shape& shape, int resolution, int attempt) {
    const Vec3d extent = shape.box.Extent();
    cell_ = std::max({extent.x, extent.y, extent.z}) / resolution;
    // The margins are no round numbers, so that grid planes do not fall onto the shape's faces,
    // and others in each attempt.
    constexpr double kMargin = 1.37, kLargestMargin = 2.4;
    const Vec3d shift = Vec3d{0.0, -0.113, 0.071} + Vec3d{0.137, 0.089, 0.111} * attempt;
    low_ = shape.box.low - (Vec3d{kMargin, kMargin, kMargin} + shift) * cell_;
    for (int axis = 0; axis < 3; ++axis) {
      size_[axis] =
          static_cast<int>(std::ceil(extent[axis] / cell_ + kMargin + kLargestMargin)) + 2;
    }
    values_.reserve(static_cast<size_t>(size_[0]) * size_[1] * size_[2]);
    for (int k = 0; k < size_[2]; ++k) {
      for (int j = 0; j < size_[1]; ++j) {
        for (int i = 0; i < size_[0]; ++i) values_.push_back(shape.distance(Position({i, j, k})));
      }
    }
  }
  using Node = std::array<int, 3>;
  size_t Index(const Node& n) const {
    return (static_cast<size_t>(n[2]) * size_[1] + n[1]) * size_[0] + n[0];
  }
  Vec3d Position(const Node& n) const {
    return low_ +
           Vec3d{static_cast<double>(n[0]), static_cast<double>(n[1]), static_cast<double>(n[2])} *
               cell_;
  }
  bool IsInside(const Node& n) const { return values_[Index(n)] < 0; }
  int size(int axis) const { return size_[axis]; }
  size_t node_count() const { return values_.size(); }
  double cell() const { return cell_; }

 private:
  double cell_ = 0;
  Vec3d low_;
  std::array<int, 3> size_{};
  std::vector<double> values_;
};

// The surface's point on the edge from a to b, whose ends lie on different sides.
Vec3d Crossing(const Shape& shape, Vec3d a, Vec3d b) {
  constexpr int kHalvings = 40;
  const bool a_inside = shape.distance(a) < 0;
  for (int i = 0; i < kHalvings; ++i) {
    const Vec3d middle = (a + b) / 2.0;
    if ((shape.distance(middle) < 0) == a_inside) {
      a = middle;
    } else {
      b = middle;
    }
  }
  return (a + b) / 2.0;
}

// Tangent planes that meet in one grid cell.
struct CellPlanes {
  Eigen::Matrix3d normal_products = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_side = Eigen::Vector3d::Zero();  // relative to the cell's lowest node
  Eigen::Vector3d point_sum = Eigen::Vector3d::Zero();
  int count = 0;
};

Eigen::Vector3d ToEigen(const Vec3d& v) { return {v.x, v.y, v.z}; }

// The point nearest to all planes; where they leave a direction open, the crossings' mean.
Vec3d Solve(const CellPlanes& planes, const Vec3d& low, double cell) {
  constexpr double kLeastEigenvalue = 0.05;  // relative; below, the surface counts as smooth
  const Eigen::Vector3d mean = planes.point_sum / planes.count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(planes.normal_products);
  const Eigen::Vector3d residual = planes.right_side - planes.normal_products * mean;
  Eigen::Vector3d point = mean;
  for (int i = 0; i < 3; ++i) {
    const double value = solver.eigenvalues()[i];
    if (value < kLeastEigenvalue * solver.eigenvalues()[2]) continue;
    const Eigen::Vector3d axis = solver.eigenvectors().col(i);
    point += axis * (axis.dot(residual) / value);
  }
  Vec3d p;
  for (int axis = 0; axis < 3; ++axis) p[axis] = low[axis] + std::clamp(point[axis], 0.0, cell);
  return p;
}

class Contour {
 public:
  Contour(const Shape& shape, int resolution, int attempt)
      : shape_(shape), grid_(shape, resolution, attempt), vertex_of_(grid_.node_count(), -1) {}

  TriangleMesh Build() {
    VisitEdges([this](const Grid::Node& node, int axis) { AddPlane(node, axis); });
    PlaceVertices();
    VisitEdges([this](const Grid::Node& node, int axis) { AddQuad(node, axis); });
    return std::move(mesh_);
  }

 private:
  // Calls `visit` for every grid edge that the surface crosses, given its lower node and axis.
  template <class Visit>
  void VisitEdges(const Visit& visit) {
    for (int k = 1; k + 1 < grid_.size(2); ++k) {
      for (int j = 1; j + 1 < grid_.size(1); ++j) {
        for (int i = 1; i + 1 < grid_.size(0); ++i) {
          for (int axis = 0; axis < 3; ++axis) {
            const Grid::Node node = {i, j, k};
            Grid::Node next = node;
            ++next[axis];
            if (grid_.IsInside(node) != grid_.IsInside(next)) visit(node, axis);
          }
        }
      }
    }
  }

  // The four grid cells around an edge, in the order of a turn about its axis.
  static std::array<Grid::Node, 4> CellsAround(const Grid::Node& node, int axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    std::array<Grid::Node, 4> cells = {node, node, node, node};
    --cells[1][u];
    --cells[2][u];
    --cells[2][v];
    --cells[3][v];
    return cells;
  }

  void AddPlane(const Grid::Node& node, int axis) {
    Grid::Node next = node;
    ++next[axis];
    const Vec3d point = Crossing(shape_, grid_.Position(node), grid_.Position(next));
    const Eigen::Vector3d normal = ToEigen(NormalAt(shape_, point));
    for (const Grid::Node& cell : CellsAround(node, axis)) {
      int32_t& vertex = vertex_of_[grid_.Index(cell)];
      if (vertex < 0) {
        vertex = static_cast<int32_t>(planes_.size());
        planes_.emplace_back();
        cells_.push_back(cell);
      }
      CellPlanes& planes = planes_[vertex];
      const Eigen::Vector3d local = ToEigen(point - grid_.Position(cell));
      planes.normal_products += normal * normal.transpose();
      planes.right_side += normal * normal.dot(local);
      planes.point_sum += local;
      ++planes.count;
    }
  }

  void PlaceVertices() {
    for (size_t i = 0; i < planes_.size(); ++i) {
      mesh_.vertices.push_back(Solve(planes_[i], grid_.Position(cells_[i]), grid_.cell()));
    }
  }

  void AddQuad(const Grid::Node& node, int axis) {
    std::array<int32_t, 4> quad{};
    const std::array<Grid::Node, 4> cells = CellsAround(node, axis);
    for (int i = 0; i < 4; ++i) quad[i] = vertex_of_[grid_.Index(cells[i])];
    // The turn is counter-clockwise seen from the axis' high end: outward if that end is outside.
    if (!grid_.IsInside(node)) std::swap(quad[1], quad[3]);
    TriangulatePolygon(quad, mesh_.vertices, &mesh_.triangles);
  }

  const Shape& shape_;
  Grid grid_;
  std::vector<int32_t> vertex_of_;  // by grid cell
  std::vector<Grid::Node> cells_;
  std::vector<CellPlanes> planes_;
  TriangleMesh mesh_;
};

// True if every directed edge is used once and so is its reverse.
bool IsClosedManifold(const TriangleMesh& mesh) {
  std::vector<std::array<int32_t, 2>> edges, reverses;
  for (const auto& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) {
      edges.push_back({t[i], t[(i + 1) % 3]});
      reverses.push_back({t[(i + 1) % 3], t[i]});
    }
  }
  std::sort(edges.begin(), edges.end());
  std::sort(reverses.begin(), reverses.end());
  return edges == reverses && std::adjacent_find(edges.begin(), edges.end()) == edges.end();
}

}  // namespace

absl::StatusOr<TriangleMesh> ContourShape(const Shape& shape, int resolution) {
  if (resolution < kLeastResolution || resolution > kMostResolution) {
    return absl::InvalidArgumentError(absl::StrCat("the resolution must be in [", kLeastResolution,
                                                   ", ", kMostResolution, "], got ", resolution));
  }
  // A grid cell that two sheets of the surface pass gets one vertex for both; another grid helps.
  for (int attempt = 0; attempt < kMostAttempts; ++attempt) {
    TriangleMesh mesh = Contour(shape, resolution, attempt).Build();
    if (IsClosedManifold(mesh)) return mesh;
  }
  return absl::InternalError(absl::StrCat("no closed surface of the ", shape.name,
                                          " was found at resolution ", resolution,
                                          "; try a larger one"));
}

}  // namespace amhex::client
