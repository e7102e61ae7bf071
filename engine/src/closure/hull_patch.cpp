#include "closure/hull_patch.h"

#include <algorithm>
#include <array>
#include <functional>

#include "closure/star_geometry.h"
#include "input/hull_queries.h"

namespace amhex {
namespace {

constexpr int kMaxLoopLength = 24;
constexpr double kImpossible = 1e18;
constexpr double kForbidden = 1e6;
// Below this quality a cell costs kQualityWeight per unit of deficit; at kMinQuality it is refused.
constexpr double kGoodQuality = 0.3;
constexpr double kMinQuality = 0.004;
constexpr double kQualityWeight = 120;
// A chord's mid point may leave the hull by this much for free.
constexpr double kFreeChordDistance = 0.08;
constexpr double kChordWeight = 15;
// Quads whose two triangles fold by more than about 26 degrees cost extra.
constexpr double kFlatCosine = 0.9;
constexpr double kFoldWeight = 10;

class PatchProgram {
 public:
  PatchProgram(const WorkingMesh& mesh, const Hull& hull, const std::vector<int>& absorbed,
               const std::vector<int32_t>& loop, const Vec3d& apex)
      : mesh_(mesh),
        hull_(hull),
        absorbed_(absorbed),
        loop_(loop),
        apex_(apex),
        n_(static_cast<int>(loop.size())) {}

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
    const double chord = whole ? 0.0 : ChordCost(i, j);
    double best = kImpossible;
    Choice choice{-1, -1};
    for (int k = i + 1; k < j; ++k) {
      TryFace(Face(i, k, j), Cost(i, k) + Cost(k, j), {k, -1}, &best, &choice);
      if (Cost(i, k) >= best) continue;
      for (int l = k + 1; l < j; ++l) {
        TryFace(Face(i, k, l, j), Cost(i, k) + Cost(k, l) + Cost(l, j), {k, l}, &best, &choice);
      }
    }
    Cost(i, j) = best + chord;
    ChoiceAt(i, j) = choice;
  }

  void TryFace(const CellFace& face, double parts, const Choice& option, double* best,
               Choice* choice) const {
    if (parts + 1 >= *best) return;
    const double cost = parts + 1 + FaceCost(face);
    if (cost < *best) *best = cost, *choice = option;
  }

  double FaceCost(const CellFace& face) const {
    const auto& x = mesh_.vertices();
    const double quality = StarQuality(face, apex_, x);
    if (quality <= kMinQuality) return kForbidden;
    double cost = kQualityWeight * std::max(0.0, kGoodQuality - quality);
    if (face.count == 4) {
      const CellFace other{3, {face.v[0], face.v[2], face.v[3], -1}};
      const double cosine = Dot(FaceUnitNormal(face, x), FaceUnitNormal(other, x));
      cost += kFoldWeight * std::max(0.0, kFlatCosine - cosine);
    }
    return mesh_.IsUsed(face) ? kForbidden : cost;
  }

  double ChordCost(int i, int j) const {
    const auto& x = mesh_.vertices();
    if (IsTakenEdge(loop_[i], loop_[j])) return kForbidden;
    const HullPoint nearest = hull_.queries->Closest((x[loop_[i]] + x[loop_[j]]) * 0.5);
    return kChordWeight * std::max(0.0, nearest.distance - kFreeChordDistance);
  }

  bool IsTakenEdge(int32_t a, int32_t b) const {
    int cells = mesh_.CellsAtEdge(a, b);
    if (cells == 0) return false;
    const std::array<int32_t, 2> edge = {std::min(a, b), std::max(a, b)};
    for (const int cell : absorbed_) {
      const CellEdges edges = EdgesOf(mesh_.corners(cell));
      cells -= std::find(edges.begin(), edges.end(), edge) != edges.end() ? 1 : 0;
    }
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
  std::vector<double> cost_;
  std::vector<Choice> choice_;
};

}  // namespace

std::optional<HullPatch> FindHullPatch(const WorkingMesh& mesh, const Hull& hull,
                                       const std::vector<int>& absorbed,
                                       const std::vector<int32_t>& loop, const Vec3d& apex) {
  if (loop.size() < 3 || loop.size() > kMaxLoopLength) return std::nullopt;
  return PatchProgram(mesh, hull, absorbed, loop, apex).Run();
}

}  // namespace amhex
