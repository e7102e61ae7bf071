#include "input/level_surface.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/status_macros.h"
#include "input/collapse_short_edges.h"
#include "input/flip_to_features.h"
#include "input/sign_grid.h"

namespace amhex {
namespace {

constexpr int64_t kMarginCells = 4;
// In cells: keeps the flat faces of boxes off the grid's own planes, where dual vertices have no
// room.
constexpr Vec3d kGridShift{0.43, 0.37, 0.31};
constexpr int kRootSteps = 8;
// Roots this near are good enough, in cells: a thousandth of an edge length.
constexpr double kRootTolerance = 4e-3;
// From the middle of a grid edge, in cells: its ends, and where a field looks for its slope there.
constexpr double kEdgeReach = 0.8;
// Directions of the normals weaker than this share of the strongest are noise (Ju et al. use 0.1).
constexpr double kWeakestDirection = 0.15;
// Vertices may leave their cell by this much, in cells, to reach a sharp edge just outside of it.
constexpr double kOutsideReach = 0.4;
// Edges shorter than this, in cells, are collapsed: vertices of neighbouring cells that found the
// same place.
constexpr double kShortestEdge = 0.3;

struct Crossing {
  int64_t key = 0;  // 3 * serial of the lower node + axis
  NodeIndex node{};
  int axis = 0;
  bool inside_first = false;
  Vec3d position;
  Vec3d normal;
};

struct DualVertex {
  Vec3d position;
  uint8_t rank = 1;  // 1 smooth, 2 on a sharp edge, 3 at a corner
};

class DualSurface {
 public:
  DualSurface(const LevelGrid& grid, const SurfaceField& field, const SignGrid& signs)
      : grid_(grid), field_(field), signs_(signs) {}

  absl::StatusOr<TriangleMesh> Extract(RunContext& run) {
    CollectCrossings();
    tbb::parallel_for(size_t{0}, crossings_.size(), [&](size_t i) {
      if (!run.ShouldStop()) Locate(crossings_[i]);
    });
    AMHEX_RETURN_IF_ERROR(run.CheckStop());
    CollectCells();
    std::vector<DualVertex> vertices(cells_.size());
    tbb::parallel_for(size_t{0}, cells_.size(),
                      [&](size_t i) { vertices[i] = PlaceVertex(cells_[i].second); });
    TriangleMesh mesh = Connect(vertices);
    std::vector<uint8_t> rank;
    rank.reserve(vertices.size());
    for (const DualVertex& vertex : vertices) rank.push_back(vertex.rank);
    CollapseShortEdges(kShortestEdge * grid_.spacing, mesh, rank);
    FlipToFeatures(rank, mesh);
    return mesh;
  }

 private:
  void CollectCrossings() {
    signs_.ForEachNode([&](const NodeIndex& node) {
      const bool inside = signs_.IsInside(node);
      for (int axis = 0; axis < 3; ++axis) {
        NodeIndex next = node;
        ++next[static_cast<size_t>(axis)];
        if (!signs_.Has(next) || signs_.IsInside(next) == inside) continue;
        crossings_.push_back({3 * signs_.Serial(node) + axis, node, axis, inside, {}, {}});
      }
    });
    std::sort(crossings_.begin(), crossings_.end(),
              [](const Crossing& a, const Crossing& b) { return a.key < b.key; });
  }

  // False position with a bracket; on a field that jumps this is bisection.
  void Locate(Crossing& crossing) const {
    NodeIndex next = crossing.node;
    ++next[static_cast<size_t>(crossing.axis)];
    Vec3d a = signs_.Position(crossing.node), b = signs_.Position(next);
    double value_a = signs_.Value(crossing.node), value_b = signs_.Value(next);
    if (!crossing.inside_first) std::swap(a, b), std::swap(value_a, value_b);
    Vec3d root = (a + b) / 2.0;
    const auto around = field_.Around(root, kEdgeReach * grid_.spacing);
    const SurfaceField& field = around != nullptr ? *around : field_;
    for (int step = 0; step < kRootSteps; ++step) {
      const double share = value_a / (value_a - value_b);
      root = a + (b - a) * std::clamp(share, 0.1, 0.9);
      const double value = field.Value(root);
      if (std::abs(value) < kRootTolerance * grid_.spacing) break;
      if (value < 0) {
        a = root, value_a = value;
      } else {
        b = root, value_b = value;
      }
    }
    crossing.position = root;
    crossing.normal = field.Normal(root, grid_.spacing);
  }

  // The lower corner of each of the four cells around a crossing edge, in the order of turning
  // about the edge's axis.
  std::array<NodeIndex, 4> CellsAround(const Crossing& crossing) const {
    const auto u = static_cast<size_t>((crossing.axis + 1) % 3);
    const auto v = static_cast<size_t>((crossing.axis + 2) % 3);
    std::array<NodeIndex, 4> cells;
    cells.fill(crossing.node);
    --cells[0][u], --cells[0][v];
    --cells[1][v];
    --cells[3][u];
    return cells;
  }

  void CollectCells() {
    for (size_t i = 0; i < crossings_.size(); ++i) {
      for (const NodeIndex& cell : CellsAround(crossings_[i])) {
        uses_.emplace_back(signs_.Serial(cell), static_cast<int32_t>(i));
      }
    }
    std::sort(uses_.begin(), uses_.end());
    for (size_t i = 0; i < uses_.size(); ++i) {
      if (i == 0 || uses_[i].first != uses_[i - 1].first) cells_.emplace_back(uses_[i].first, i);
    }
  }

  int32_t VertexOf(const NodeIndex& cell) const {
    const auto found = std::lower_bound(cells_.begin(), cells_.end(),
                                        std::pair<int64_t, size_t>(signs_.Serial(cell), 0));
    return static_cast<int32_t>(found - cells_.begin());
  }

  // Least squares of the distances to the crossings' planes, about the crossings' mean; directions
  // that the normals hardly determine are left alone.
  DualVertex PlaceVertex(size_t first_use) const {
    const int64_t cell = uses_[first_use].first;
    Eigen::Matrix3d planes = Eigen::Matrix3d::Zero();
    Eigen::Vector3d offsets = Eigen::Vector3d::Zero();
    Vec3d mean;
    int count = 0;
    for (size_t i = first_use; i < uses_.size() && uses_[i].first == cell; ++i, ++count) {
      mean += crossings_[static_cast<size_t>(uses_[i].second)].position;
    }
    mean /= count;
    for (size_t i = first_use; i < uses_.size() && uses_[i].first == cell; ++i) {
      const Crossing& crossing = crossings_[static_cast<size_t>(uses_[i].second)];
      const Eigen::Vector3d n(crossing.normal.x, crossing.normal.y, crossing.normal.z);
      planes += n * n.transpose();
      offsets += n * Dot(crossing.normal, crossing.position - mean);
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(planes);
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    int rank = 0;
    for (int i = 0; i < 3; ++i) {
      const double strength = solver.eigenvalues()[i];
      if (!(strength > kWeakestDirection * solver.eigenvalues()[2]) || !(strength > 0)) continue;
      const Eigen::Vector3d direction = solver.eigenvectors().col(i);
      shift += direction * (direction.dot(offsets) / strength);
      ++rank;
    }
    const int64_t nx = grid_.node_count[0], ny = grid_.node_count[1];
    const Vec3d low = signs_.Position({cell % nx, cell / nx % ny, cell / nx / ny});
    const double reach = kOutsideReach * grid_.spacing;
    const Vec3d from = low - Vec3d{reach, reach, reach};
    const double room = grid_.spacing + 2 * reach;
    const Vec3d wanted = mean + Vec3d{shift[0], shift[1], shift[2]};
    return {ComponentMin(ComponentMax(wanted, from), from + Vec3d{room, room, room}),
            static_cast<uint8_t>(rank)};
  }

  TriangleMesh Connect(const std::vector<DualVertex>& vertices) const {
    TriangleMesh mesh;
    mesh.vertices.reserve(vertices.size());
    for (const DualVertex& vertex : vertices) mesh.vertices.push_back(vertex.position);
    mesh.triangles.reserve(2 * crossings_.size());
    for (const Crossing& crossing : crossings_) {
      std::array<int32_t, 4> quad;
      const std::array<NodeIndex, 4> cells = CellsAround(crossing);
      for (size_t i = 0; i < 4; ++i) quad[i] = VertexOf(cells[i]);
      // Turning about the axis looks along it, which is outward if the lower node is inside.
      if (!crossing.inside_first) std::swap(quad[1], quad[3]);
      if (SplitAlongFirst(quad, vertices)) {
        mesh.triangles.push_back({quad[0], quad[1], quad[2]});
        mesh.triangles.push_back({quad[0], quad[2], quad[3]});
      } else {
        mesh.triangles.push_back({quad[1], quad[2], quad[3]});
        mesh.triangles.push_back({quad[1], quad[3], quad[0]});
      }
    }
    return mesh;
  }

  // Diagonals follow sharp edges; elsewhere the shorter one is taken.
  bool SplitAlongFirst(const std::array<int32_t, 4>& quad,
                       const std::vector<DualVertex>& vertices) const {
    const auto at = [&](size_t i) -> const DualVertex& {
      return vertices[static_cast<size_t>(quad[i])];
    };
    const bool first_sharp = at(0).rank >= 2 && at(2).rank >= 2;
    const bool second_sharp = at(1).rank >= 2 && at(3).rank >= 2;
    if (first_sharp != second_sharp) return first_sharp;
    return SquaredNorm(at(0).position - at(2).position) <=
           SquaredNorm(at(1).position - at(3).position);
  }

  const LevelGrid& grid_;
  const SurfaceField& field_;
  const SignGrid& signs_;
  std::vector<Crossing> crossings_;                // sorted by key
  std::vector<std::pair<int64_t, int32_t>> uses_;  // (cell, crossing), sorted
  std::vector<std::pair<int64_t, size_t>> cells_;  // (cell, its first use), sorted
};

}  // namespace

EightValues SurfaceField::Values(const EightPoints& p) const {
  EightValues values;
  for (size_t i = 0; i < p.size(); ++i) values[i] = Value(p[i]);
  return values;
}

std::unique_ptr<SurfaceField> SurfaceField::Around(const Vec3d& /*centre*/,
                                                   double /*reach*/) const {
  return nullptr;
}

LevelGrid GridAround(const Box3d& box, double spacing) {
  LevelGrid grid;
  grid.spacing = spacing;
  const double margin = static_cast<double>(kMarginCells) * spacing;
  grid.low = box.low - Vec3d{margin, margin, margin} - kGridShift * spacing;
  const Vec3d extent = box.Extent();
  for (int axis = 0; axis < 3; ++axis) {
    grid.node_count[static_cast<size_t>(axis)] =
        static_cast<int64_t>(std::ceil(extent[axis] / spacing)) + 2 * kMarginCells + 2;
  }
  return grid;
}

absl::StatusOr<TriangleMesh> ExtractLevel(const LevelGrid& grid, const SurfaceField& field,
                                          const std::vector<Vec3d>& seeds, RunContext& run) {
  SignGrid signs(grid, field);
  AMHEX_RETURN_IF_ERROR(signs.Fill(seeds, run));
  return DualSurface(grid, field, signs).Extract(run);
}

}  // namespace amhex
