#include "closure/hull_patch.h"

#include <algorithm>
#include <array>
#include <functional>

#include "closure/cell_contains.h"
#include "closure/star_geometry.h"
#include "input/hull_queries.h"

namespace amhex {
namespace {

constexpr size_t kMaxLoopLength = 24;
constexpr double kImpossible = 1e18;
constexpr double kForbidden = 1e6;
// Below this quality a cell costs kQualityWeight per unit of deficit; at kMinStarQuality it is
// refused.
constexpr double kGoodQuality = 0.25;
constexpr double kMinStarQuality = 0.004;
constexpr double kQualityWeight = 60;
constexpr double kQualitySlack = 1e-9;
// A chord's mid point may leave the hull by this much for free.
constexpr double kFreeChordDistance = 0.08;
constexpr double kChordWeight = 15;
// Quads whose two triangles fold by more than about 26 degrees cost extra.
constexpr double kFlatCosine = 0.9;
constexpr double kFoldWeight = 10;
// A face follows the hull if its centre is this near and the normals agree.
constexpr double kMaxFaceSag = 0.3;
constexpr double kFaceNormalCosine = 0.3;

// Outside of a patch's faces, edge lengths.
constexpr double kProbeDistance = 1e-3;

class PatchProgram {
 public:
  PatchProgram(const WorkingMesh& mesh, const Hull& hull, const PatchRequest& request)
      : mesh_(mesh),
        hull_(hull),
        absorbed_(request.absorbed),
        loop_(request.loop),
        apex_(request.apex),
        n_(static_cast<int>(request.loop.size())) {
    for (const int32_t v : loop_) {
      on_hull_.push_back(request.kind == PatchKind::kHull || IsOnHull(hull, mesh.vertices()[v]));
    }
  }

  std::optional<HullPatch> Run() {
    cost_.assign(static_cast<size_t>(n_) * n_, kImpossible);
    choice_.assign(static_cast<size_t>(n_) * n_, {-1, -1});
    for (int i = 0; i + 1 < n_; ++i) Cost(i, i + 1) = 0;
    for (int length = 2; length < n_; ++length) {
      for (int i = 0; i + length < n_; ++i) Solve(i, i + length);
    }
    if (Cost(0, n_ - 1) >= kForbidden) return std::nullopt;
    HullPatch patch;
    patch.cost = Cost(0, n_ - 1);
    Collect(0, n_ - 1, &patch.faces);
    return patch;
  }

 private:
  // Second index -1 for a triangle.
  using Choice = std::array<int, 2>;

  double& Cost(int i, int j) { return cost_[static_cast<size_t>(i) * n_ + j]; }
  Choice& ChoiceAt(int i, int j) { return choice_[static_cast<size_t>(i) * n_ + j]; }

  CellFace Face(int i, int k, int j) const { return {3, {loop_[i], loop_[k], loop_[j], -1}}; }
  CellFace Face(int i, int k, int l, int j) const {
    return {4, {loop_[i], loop_[k], loop_[l], loop_[j]}};
  }

  // Chain i..j closed by the edge j -> i: the face at that edge is a triangle or a quad.
  void Solve(int i, int j) {
    const bool whole = i == 0 && j == n_ - 1;
    double best = kImpossible;
    Choice choice{-1, -1};
    for (int k = i + 1; k < j; ++k) {
      TryFace(Face(i, k, j), Cost(i, k) + Cost(k, j), {k, -1}, &best, &choice);
      if (Cost(i, k) >= best) continue;
      for (int l = k + 1; l < j; ++l) {
        TryFace(Face(i, k, l, j), Cost(i, k) + Cost(k, l) + Cost(l, j), {k, l}, &best, &choice);
      }
    }
    // What is forbidden already need not be looked at on the hull.
    Cost(i, j) = whole || best >= kForbidden ? best : best + ChordCost(i, j);
    ChoiceAt(i, j) = choice;
  }

  void TryFace(const CellFace& face, double parts, const Choice& option, double* best,
               Choice* choice) const {
    if (parts + 1 >= *best) return;
    const double cost = parts + 1 + FaceCost(face, *best - parts - 1);
    if (cost < *best) *best = cost, *choice = option;
  }

  // Where it is no less than `most`, some value that is not.
  double FaceCost(const CellFace& face, double most) const {
    const auto& x = mesh_.vertices();
    // A quality at which the deficit alone costs so much; below, for rounding.
    const double hopeless = kGoodQuality - most / kQualityWeight - kQualitySlack;
    const double quality = StarQuality(face, apex_, x, std::max(kMinStarQuality, hopeless));
    if (quality <= kMinStarQuality || quality <= hopeless) return kForbidden;
    double cost = kQualityWeight * std::max(0.0, kGoodQuality - quality);
    if (face.count == 4) {
      const CellFace other{3, {face.v[0], face.v[2], face.v[3], -1}};
      const double cosine = Dot(FaceUnitNormal(face, x), FaceUnitNormal(other, x));
      cost += kFoldWeight * std::max(0.0, kFlatCosine - cosine);
    }
    return cost < most && mesh_.IsUsed(face) ? kForbidden : cost;
  }

  double ChordCost(int i, int j) const {
    const auto& x = mesh_.vertices();
    if (!on_hull_[i] || !on_hull_[j]) return 0;
    if (IsTakenEdge(loop_[i], loop_[j])) return kForbidden;
    const HullPoint nearest = hull_.queries->Closest((x[loop_[i]] + x[loop_[j]]) * 0.5);
    return kChordWeight * std::max(0.0, nearest.distance - kFreeChordDistance);
  }

  bool IsTakenEdge(int32_t a, int32_t b) const {
    int cells = mesh_.CellsAtEdge(a, b);
    if (cells == 0) return false;
    for (const int cell : absorbed_) cells -= HasEdge(mesh_.corners(cell), a, b) ? 1 : 0;
    return cells > 0;
  }

  void Collect(int i, int j, std::vector<CellFace>* faces) {
    if (j - i < 2) return;
    const auto [k, l] = ChoiceAt(i, j);
    Collect(i, k, faces);
    if (l < 0) {
      faces->push_back(Face(i, k, j));
      Collect(k, j, faces);
    } else {
      faces->push_back(Face(i, k, l, j));
      Collect(k, l, faces);
      Collect(l, j, faces);
    }
  }

  const WorkingMesh& mesh_;
  const Hull& hull_;
  const std::vector<int>& absorbed_;
  const std::vector<int32_t>& loop_;
  const Vec3d apex_;
  const int n_;
  std::vector<uint8_t> on_hull_;  // [loop vertex]
  std::vector<double> cost_;
  std::vector<Choice> choice_;
};

}  // namespace

std::optional<HullPatch> FindHullPatch(const WorkingMesh& mesh, const Hull& hull,
                                       const PatchRequest& request) {
  const size_t length = request.loop.size();
  if (length < 3 || length > kMaxLoopLength) return std::nullopt;
  return PatchProgram(mesh, hull, request).Run();
}

bool RunsThroughCells(const WorkingMesh& mesh, const std::vector<CellFace>& faces,
                      const std::vector<int>& absorbed) {
  const std::vector<Vec3d>& x = mesh.vertices();
  return std::any_of(faces.begin(), faces.end(), [&](const CellFace& face) {
    const Vec3d centre = FaceCentroid(face, x);
    // In the middle and halfway to the edges: a quad is not flat.
    for (int j = -1; j < face.count; ++j) {
      const Vec3d at =
          j < 0 ? centre : centre / 2.0 + (x[face.v[j]] + x[face.v[(j + 1) % face.count]]) / 4.0;
      const Vec3d normal =
          j < 0
              ? FaceUnitNormal(face, x)
              : Normalized(Cross(x[face.v[j]] - centre, x[face.v[(j + 1) % face.count]] - centre));
      const Vec3d probe = at - normal * kProbeDistance;
      const auto holds_probe = [&](int cell) {
        return !std::binary_search(absorbed.begin(), absorbed.end(), cell) &&
               CellContains(mesh.corners(cell), x, probe);
      };
      for (int k = 0; k < face.count; ++k) {
        if (mesh.AnyCellAt(face.v[k], holds_probe)) return true;
      }
    }
    return false;
  });
}

bool IsOnHull(const Hull& hull, const Vec3d& p) {
  return hull.queries->IsWithin(p, kOnHullDistance);
}

bool FollowsHull(const Hull& hull, const CellFace& face, const std::vector<Vec3d>& vertices) {
  for (int j = 0; j < face.count; ++j) {
    if (!IsOnHull(hull, vertices[face.v[j]])) return false;
  }
  const HullPoint nearest = hull.queries->Closest(FaceCentroid(face, vertices), kMaxFaceSag);
  return nearest.triangle >= 0 &&
         -Dot(FaceUnitNormal(face, vertices), nearest.normal) > kFaceNormalCosine;
}

}  // namespace amhex
