#include "closure/recap_star.h"

#include <algorithm>
#include <array>
#include <utility>

#include "closure/polygon_cuts.h"
#include "closure/star_fill.h"
#include "input/triangle_math.h"
#include "optimize/cell_quality.h"

namespace amhex {
namespace {

constexpr size_t kMostCells = 24;
// A vertex of the hull that goes is at most this far from the new faces, edge lengths: what a mesh
// may be away from its input. How far the faces may turn from what was there (cosine).
constexpr double kMostSag = 1.0 / 6;
constexpr double kMinAgreement = 0.5;
// The gain that is worth it, in cells of scaled Jacobian 0 that become perfect.
constexpr double kMinGain = 0.1;

// How many triangles the cuts of a polygon may have: all up to 6 vertices, few up to 8, then as few
// as there can be. So there are 192 ways at most, where there could be thousands.
size_t MostTriangles(size_t rim_size) {
  if (rim_size <= 6) return rim_size;
  return rim_size <= 8 ? 2 : rim_size % 2;
}
constexpr size_t kMostRimVertices = 10;

using Edge = std::array<int32_t, 2>;

// The one loop around the faces, in their orientation; empty if it is not one, or meets itself.
std::vector<int32_t> RimOf(const std::vector<CellFace>& faces) {
  std::vector<Edge> edges;
  for (const CellFace& face : faces) {
    for (int i = 0; i < face.count; ++i) edges.push_back({face.v[i], face.v[(i + 1) % face.count]});
  }
  std::sort(edges.begin(), edges.end());
  std::vector<Edge> border;
  for (const Edge& edge : edges) {
    if (!std::binary_search(edges.begin(), edges.end(), Edge{edge[1], edge[0]})) {
      border.push_back(edge);
    }
  }
  if (border.empty()) return {};
  std::vector<int32_t> rim = {border[0][0]};
  for (size_t i = 1; i <= border.size(); ++i) {
    const auto next = std::lower_bound(border.begin(), border.end(), Edge{rim.back(), -1});
    if (next == border.end() || (*next)[0] != rim.back()) return {};
    const bool is_closed = (*next)[1] == rim.front();
    if (is_closed != (i == border.size())) return {};
    if (!is_closed) rim.push_back((*next)[1]);
  }
  return rim;
}

std::vector<CellFace> HullFacesOf(const WorkingMesh& mesh, const std::vector<int>& cells) {
  std::vector<CellFace> faces;
  for (const int cell : cells) {
    mesh.VisitHullFaces(cell, [&](const CellFace& face) { faces.push_back(face); });
  }
  return faces;
}

// A star and the part of the hull that it has.
class HullStar {
 public:
  HullStar(const WorkingMesh& mesh, int32_t apex, const std::vector<int>& star)
      : mesh_(mesh), inner_{star, {}, {}}, patch_(HullFacesOf(mesh, star)), rim_(RimOf(patch_)) {
    const std::vector<Vec3d>& x = mesh.vertices();
    for (const CellFace& face : patch_) {
      normal_ += FaceUnitNormal(face, x);
      for (int i = 0; i < face.count; ++i) {
        const int32_t v = face.v[i];
        if (std::find(rim_.begin(), rim_.end(), v) == rim_.end()) lost_.push_back(v);
      }
    }
    normal_ = Normalized(normal_);
    for (const CellFace& wall : SurfaceOf(mesh, apex, star).walls) {
      if (mesh.Owner(wall) != WorkingMesh::kHull) inner_.walls.push_back(wall);
    }
    for (const CellFace& wall : inner_.walls) {
      middle_ += FaceCentroid(wall, x) / static_cast<double>(inner_.walls.size());
    }
  }

  std::optional<StarPeeler> Best(StarFolds folds, double loss_to_beat) const {
    std::optional<StarPeeler> best;
    double least = loss_to_beat - kMinGain;
    if (rim_.empty() || rim_.size() > kMostRimVertices) return best;
    for (const std::vector<CellFace>& cap : CutPolygon(rim_, MostTriangles(rim_.size()))) {
      if (!Fits(cap)) continue;
      StarSurface surface = inner_;
      for (const CellFace& face : cap) {
        surface.walls.push_back(Reversed(face));
        surface.hull.push_back(face);
      }
      if (HasRepeatedFace(surface.walls)) continue;
      StarPeeler peeler(mesh_, std::move(surface), middle_, folds);
      if (!peeler.Run() || peeler.Loss() >= least) continue;
      least = peeler.Loss();
      best.emplace(std::move(peeler));
    }
    return best;
  }

 private:
  // True if the cap lies where the patch did and no cell beside the star has its faces and edges.
  bool Fits(const std::vector<CellFace>& cap) const {
    for (const CellFace& face : cap) {
      if (Dot(FaceUnitNormal(face, mesh_.vertices()), normal_) < kMinAgreement) return false;
      if (IsForeign(mesh_.Owner(face)) || IsForeign(mesh_.Across(face))) return false;
      for (int i = 0; i < face.count; ++i) {
        if (IsForeignDiagonal(face.v[i], face.v[(i + 1) % face.count])) return false;
      }
    }
    return std::all_of(lost_.begin(), lost_.end(),
                       [&](int32_t v) { return DistanceTo(cap, mesh_.vertices()[v]) <= kMostSag; });
  }

  double DistanceTo(const std::vector<CellFace>& cap, const Vec3d& p) const {
    const std::vector<Vec3d>& x = mesh_.vertices();
    double least = 1e300;
    for (const CellFace& face : cap) {
      for (int i = 0; i + 2 < face.count; ++i) {
        const Vec3d nearest =
            ClosestPointOnTriangle(p, x[face.v[0]], x[face.v[i + 1]], x[face.v[i + 2]]);
        least = std::min(least, Norm(nearest - p));
      }
    }
    return least;
  }

  bool IsForeign(int32_t cell) const {
    return cell >= 0 && !std::binary_search(inner_.cells.begin(), inner_.cells.end(), cell);
  }

  // True for a diagonal of the rim that cells beside the star have as an edge.
  bool IsForeignDiagonal(int32_t a, int32_t b) const {
    for (size_t i = 0; i < rim_.size(); ++i) {
      if (rim_[i] == a && rim_[(i + 1) % rim_.size()] == b) return false;
    }
    int own = 0;
    for (const int cell : inner_.cells) own += HasEdge(mesh_.corners(cell), a, b) ? 1 : 0;
    return mesh_.CellsAtEdge(a, b) > own;
  }

  const WorkingMesh& mesh_;
  StarSurface inner_;  // without what is hull
  std::vector<CellFace> patch_;
  std::vector<int32_t> rim_;   // around the patch
  std::vector<int32_t> lost_;  // vertices inside of it
  Vec3d normal_;               // of the patch
  Vec3d middle_;               // of the walls
};

}  // namespace

bool IsAtHull(const WorkingMesh& mesh, int32_t apex, const std::vector<int>& star) {
  for (const CellFace& face : HullFacesOf(mesh, star)) {
    const auto end = face.v.begin() + face.count;
    if (std::find(face.v.begin(), end, apex) != end) return true;
  }
  return false;
}

double LossOf(const WorkingMesh& mesh, const std::vector<int>& cells) {
  double loss = 0;
  for (const int cell : cells) loss += 1 - CellQuality(mesh.corners(cell), mesh.vertices());
  return loss;
}

std::optional<StarPeeler> RecapStar(const WorkingMesh& mesh, int32_t apex,
                                    const std::vector<int>& star, StarFolds folds,
                                    double loss_to_beat) {
  if (star.size() > kMostCells) return std::nullopt;
  return HullStar(mesh, apex, star).Best(folds, loss_to_beat);
}

}  // namespace amhex
