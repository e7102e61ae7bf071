#include "closure/fill_scope.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace amhex {
namespace {

// Cells are considered this far around a cavity (edge lengths); tetrahedra of the filling must
// keep the margin from there, where the complex may still differ from that of the whole mesh.
constexpr double kScopeReach = 5.0;
constexpr double kScopeMargin = 1.75;
constexpr double kBinSize = 4.0;  // edge lengths

bool Contains(const Box3d& box, const Vec3d& p, double margin) {
  for (int axis = 0; axis < 3; ++axis) {
    if (p[axis] < box.low[axis] - margin || p[axis] > box.high[axis] + margin) return false;
  }
  return true;
}

// Sum of the outer products of a hexahedron's three mean edge vectors: the same however its axes
// are numbered or turned.
Eigen::Matrix3d ShapeOf(const CellCorners& c, const std::vector<Vec3d>& x) {
  static constexpr int kAxisEdges[3][4][2] = {{{0, 1}, {3, 2}, {4, 5}, {7, 6}},
                                              {{0, 3}, {1, 2}, {4, 7}, {5, 6}},
                                              {{0, 4}, {1, 5}, {2, 6}, {3, 7}}};
  Eigen::Matrix3d shape = Eigen::Matrix3d::Zero();
  for (const auto& edges : kAxisEdges) {
    Vec3d mean;
    for (const auto& [a, b] : edges) mean += (x[c[b]] - x[c[a]]) * 0.25;
    const Eigen::Vector3d e(mean.x, mean.y, mean.z);
    shape += e * e.transpose();
  }
  return shape;
}

}  // namespace

void CellBins::AddNewCells(const WorkingMesh& mesh) {
  for (; next_cell_ < mesh.cell_slots(); ++next_cell_) {
    if (mesh.alive(next_cell_))
      cells_[BinOf(CellCentroid(mesh.corners(next_cell_), mesh.vertices()))].push_back(next_cell_);
  }
}

CellBins::Bin CellBins::BinOf(const Vec3d& p) {
  Bin bin;
  for (int axis = 0; axis < 3; ++axis) {
    bin[axis] = static_cast<int32_t>(std::floor(p[axis] / kBinSize));
  }
  return bin;
}

std::vector<int> CellBins::Around(const Box3d& box, double reach) const {
  const Vec3d margin{reach, reach, reach};
  const Bin low = BinOf(box.low - margin), high = BinOf(box.high + margin);
  std::vector<int> found;
  for (int32_t x = low[0]; x <= high[0]; ++x) {
    for (int32_t y = low[1]; y <= high[1]; ++y) {
      for (int32_t z = low[2]; z <= high[2]; ++z) {
        const auto bin = cells_.find({x, y, z});
        if (bin != cells_.end()) found.insert(found.end(), bin->second.begin(), bin->second.end());
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

FillScope ScopeOfWholeMesh(const WorkingMesh& mesh, const Cavities& cavities) {
  FillScope scope;
  for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
    if (mesh.alive(cell)) scope.cells.push_back(cell);
  }
  scope.cavities.resize(cavities.count());
  std::iota(scope.cavities.begin(), scope.cavities.end(), 0);
  return scope;
}

FillScope ScopeAroundCavity(const WorkingMesh& mesh, const CellBins& bins, const Cavities& cavities,
                            int cavity) {
  Box3d box;
  for (const CellFace& face : cavities.faces[cavity]) {
    for (int j = 0; j < face.count; ++j) box.Extend(mesh.vertices()[face.v[j]]);
  }
  FillScope scope;
  scope.is_local = true;
  scope.cavities = {cavity};
  scope.safe_box = box;
  const double safe = kScopeReach - kScopeMargin;
  scope.safe_box.low -= Vec3d{safe, safe, safe};
  scope.safe_box.high += Vec3d{safe, safe, safe};
  Eigen::Matrix3d shape = Eigen::Matrix3d::Zero();
  int hexahedra = 0;
  for (const int cell : bins.Around(box, kScopeReach)) {
    if (!mesh.alive(cell)) continue;
    const Vec3d centre = CellCentroid(mesh.corners(cell), mesh.vertices());
    if (!Contains(box, centre, kScopeReach)) continue;
    scope.cells.push_back(cell);
    if (mesh.is_hexahedron(cell) && Contains(box, centre, kScopeMargin)) {
      shape += ShapeOf(mesh.corners(cell), mesh.vertices());
      ++hexahedra;
    }
  }
  if (hexahedra > 0) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(shape / hexahedra);
    if (solver.eigenvalues()[0] > 1e-6) {
      const Eigen::Matrix3d map = solver.operatorInverseSqrt();
      for (int row = 0; row < 3; ++row) scope.metric[row] = {map(row, 0), map(row, 1), map(row, 2)};
    }
  }
  return scope;
}

}  // namespace amhex
