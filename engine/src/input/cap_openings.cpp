#include "input/cap_openings.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/status_macros.h"
#include "input/triangle_math.h"

namespace amhex {
namespace {

constexpr size_t kLongestWholeLoop = 256;
constexpr double kForbidden = 1e100;

// The chords a patch may not use because the surface has them as edges already.
class ExistingEdges {
 public:
  ExistingEdges(const TriangleMesh& mesh, const std::vector<std::vector<int32_t>>& loops) {
    std::vector<uint8_t> on_loop(mesh.vertices.size(), 0);
    for (const auto& loop : loops) {
      for (const int32_t v : loop) on_loop[static_cast<size_t>(v)] = 1;
    }
    for (const auto& t : mesh.triangles) {
      for (size_t i = 0; i < 3; ++i) {
        const int32_t u = t[i], v = t[(i + 1) % 3];
        if (on_loop[static_cast<size_t>(u)] != 0 && on_loop[static_cast<size_t>(v)] != 0) {
          edges_.push_back(std::minmax(u, v));
        }
      }
    }
    std::sort(edges_.begin(), edges_.end());
  }
  bool Has(int32_t u, int32_t v) const {
    return std::binary_search(edges_.begin(), edges_.end(),
                              std::pair<int32_t, int32_t>(std::minmax(u, v)));
  }

 private:
  std::vector<std::pair<int32_t, int32_t>> edges_;
};

class LoopFiller {
 public:
  LoopFiller(const ExistingEdges& existing, TriangleMesh& mesh)
      : existing_(existing), mesh_(mesh) {}

  absl::Status Fill(const std::vector<int32_t>& loop, RunContext& run) {
    std::vector<std::vector<int32_t>> pending;
    pending.push_back(loop);
    while (!pending.empty()) {
      AMHEX_RETURN_IF_ERROR(run.CheckStop());
      const std::vector<int32_t> part = std::move(pending.back());
      pending.pop_back();
      if (part.size() <= kLongestWholeLoop) {
        FillWhole(part);
        continue;
      }
      const auto [i, j] = ShortChord(part);
      pending.emplace_back(part.begin() + static_cast<std::ptrdiff_t>(i),
                           part.begin() + static_cast<std::ptrdiff_t>(j) + 1);
      std::vector<int32_t> rest(part.begin() + static_cast<std::ptrdiff_t>(j), part.end());
      rest.insert(rest.end(), part.begin(), part.begin() + static_cast<std::ptrdiff_t>(i) + 1);
      pending.push_back(std::move(rest));
    }
    return absl::OkStatus();
  }

 private:
  const Vec3d& At(int32_t v) const { return mesh_.vertices[static_cast<size_t>(v)]; }

  // The shortest chord that leaves at least a quarter of the loop on either side; i < j.
  std::pair<size_t, size_t> ShortChord(const std::vector<int32_t>& loop) const {
    const size_t n = loop.size();
    std::pair<size_t, size_t> best{0, n / 2};
    double shortest = kForbidden;
    for (size_t i = 0; i < n; ++i) {
      for (size_t j = i + n / 4; j < n && j - i <= n - n / 4; ++j) {
        const double squared = SquaredNorm(At(loop[i]) - At(loop[j]));
        if (squared < shortest && !existing_.Has(loop[i], loop[j])) {
          shortest = squared, best = {i, j};
        }
      }
    }
    return best;
  }

  // cost[i][j] = least area of a patch between the chord i..j and the loop from i to j.
  void FillWhole(const std::vector<int32_t>& loop) {
    const size_t n = loop.size();
    std::vector<double> cost(n * n, 0);
    std::vector<size_t> apex(n * n, 0);
    for (size_t span = 2; span < n; ++span) {
      for (size_t i = 0; i + span < n; ++i) {
        const size_t j = i + span;
        const bool is_whole = span == n - 1;
        const double chord = !is_whole && existing_.Has(loop[i], loop[j]) ? kForbidden : 0.0;
        double least = 10 * kForbidden * static_cast<double>(n);
        for (size_t k = i + 1; k < j; ++k) {
          const double area = Norm(DoubleAreaVector(At(loop[i]), At(loop[k]), At(loop[j]))) / 2;
          const double total = cost[i * n + k] + cost[k * n + j] + area + chord;
          if (total < least) least = total, apex[i * n + j] = k;
        }
        cost[i * n + j] = least;
      }
    }
    std::vector<std::pair<size_t, size_t>> pending = {{0, n - 1}};
    while (!pending.empty()) {
      const auto [i, j] = pending.back();
      pending.pop_back();
      if (j < i + 2) continue;
      const size_t k = apex[i * n + j];
      mesh_.triangles.push_back({loop[i], loop[k], loop[j]});
      pending.emplace_back(i, k);
      pending.emplace_back(k, j);
    }
  }

  const ExistingEdges& existing_;
  TriangleMesh& mesh_;
};

}  // namespace

absl::Status CapOpenings(const std::vector<std::vector<int32_t>>& loops, RunContext& run,
                         TriangleMesh& mesh) {
  const ExistingEdges existing(mesh, loops);
  LoopFiller filler(existing, mesh);
  for (const auto& loop : loops) {
    AMHEX_RETURN_IF_ERROR(filler.Fill(loop, run));
  }
  return absl::OkStatus();
}

}  // namespace amhex
