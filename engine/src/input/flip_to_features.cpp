#include "input/flip_to_features.h"

#include <algorithm>
#include <utility>

#include "input/surface_topology.h"
#include "input/triangle_math.h"

namespace amhex {
namespace {

// Triangles may turn by up to 120 degrees when they flip: across a feature they have to.
constexpr double kLeastCosine = -0.5;
// Height over longest side below which a triangle is nearly a line: its normal says little.
constexpr double kLineHeightRatio = 0.08;

double HeightRatio(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const double longest = std::max({SquaredNorm(b - a), SquaredNorm(c - b), SquaredNorm(a - c)});
  return longest > 0 ? Norm(DoubleAreaVector(a, b, c)) / longest : 0;
}

class Flipper {
 public:
  Flipper(const std::vector<uint8_t>& rank, TriangleMesh& mesh)
      : rank_(rank), mesh_(mesh), adjacency_(FindEdgeAdjacency(mesh)) {
    for (const auto& t : mesh.triangles) {
      for (size_t i = 0; i < 3; ++i) edges_.push_back(std::minmax(t[i], t[(i + 1) % 3]));
    }
    std::sort(edges_.begin(), edges_.end());
    edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  }

  // One pass over all edges. `wanted` decides by the four vertices a, b, c, d around edge a-b.
  template <class Wanted>
  int64_t Run(const Wanted& wanted) {
    int64_t flips = 0;
    // A triangle flips once: its neighbours in `adjacency_` are wrong afterwards.
    std::vector<uint8_t> touched(mesh_.triangles.size(), 0);
    for (size_t e = 0; e < adjacency_.opposite.size(); ++e) {
      const HalfEdgeId other = adjacency_.opposite[e];
      if (other <= static_cast<HalfEdgeId>(e)) continue;
      const size_t left = e / 3, right = static_cast<size_t>(other / 3);
      if (touched[left] != 0 || touched[right] != 0) continue;
      if (!Flip(e, static_cast<size_t>(other), wanted)) continue;
      touched[left] = touched[right] = 1;
      ++flips;
    }
    return flips;
  }

  // The edge is the long side of a line-like triangle.
  bool IsUnderLine(int32_t a, int32_t b, int32_t c, int32_t d) const {
    const double squared = SquaredNorm(At(a) - At(b));
    const auto is_cap = [&](int32_t apex) {
      return SquaredNorm(At(apex) - At(a)) < squared && SquaredNorm(At(apex) - At(b)) < squared &&
             HeightRatio(At(a), At(b), At(apex)) < kLineHeightRatio;
    };
    return is_cap(c) || is_cap(d);
  }

  bool SeparatesFeatures(int32_t a, int32_t b, int32_t c, int32_t d) const {
    return IsFeature(c) && IsFeature(d) && !(IsFeature(a) && IsFeature(b)) &&
           HeightRatio(At(a), At(d), At(c)) > kLineHeightRatio &&
           HeightRatio(At(b), At(c), At(d)) > kLineHeightRatio;
  }

 private:
  bool IsFeature(int32_t v) const { return rank_[static_cast<size_t>(v)] >= 2; }
  const Vec3d& At(int32_t v) const { return mesh_.vertices[static_cast<size_t>(v)]; }
  Vec3d NormalOf(int32_t a, int32_t b, int32_t c) const {
    return Normalized(DoubleAreaVector(At(a), At(b), At(c)));
  }

  // The edge a-b between triangles (a, b, c) and (b, a, d) becomes c-d.
  template <class Wanted>
  bool Flip(size_t e, size_t other, const Wanted& is_wanted) {
    auto& left = mesh_.triangles[e / 3];
    auto& right = mesh_.triangles[other / 3];
    const int32_t a = left[e % 3], b = left[(e + 1) % 3], c = left[(e + 2) % 3];
    const int32_t d = right[(other + 2) % 3];
    if (c == d || !is_wanted(a, b, c, d)) return false;
    const std::pair<int32_t, int32_t> wanted = std::minmax(c, d);
    if (std::binary_search(edges_.begin(), edges_.end(), wanted) ||
        std::find(made_.begin(), made_.end(), wanted) != made_.end()) {
      return false;
    }
    // By area: the normals of line-like triangles do not count.
    const Vec3d before =
        DoubleAreaVector(At(a), At(b), At(c)) + DoubleAreaVector(At(b), At(a), At(d));
    const double least = kLeastCosine * Norm(before);
    if (Dot(NormalOf(a, d, c), before) < least || Dot(NormalOf(b, c, d), before) < least) {
      return false;
    }
    left = {a, d, c};
    right = {b, c, d};
    made_.push_back(wanted);
    return true;
  }

  const std::vector<uint8_t>& rank_;
  TriangleMesh& mesh_;
  const EdgeAdjacency adjacency_;
  std::vector<std::pair<int32_t, int32_t>> edges_;  // sorted, before any flip
  std::vector<std::pair<int32_t, int32_t>> made_;
};

}  // namespace

int64_t FlipToFeatures(const std::vector<uint8_t>& rank, TriangleMesh& mesh) {
  const auto pass = [&](auto condition) {
    Flipper flipper(rank, mesh);
    return flipper.Run([&](int32_t a, int32_t b, int32_t c, int32_t d) {
      return (flipper.*condition)(a, b, c, d);
    });
  };
  const int64_t lines = pass(&Flipper::IsUnderLine);
  return lines + pass(&Flipper::SeparatesFeatures);
}

}  // namespace amhex
