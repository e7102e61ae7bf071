#include "closure/peel_stars.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "closure/star_geometry.h"
#include "closure/working_mesh.h"
#include "optimize/cell_quality.h"

namespace amhex {
namespace {

// New cells must be this good, or no worse than the worst that they replace.
constexpr double kMinQuality = 0.1;
constexpr double kSolidAngleTolerance = 0.1;
constexpr int kStarsPerStopCheck = 64;

using Walls = std::vector<CellFace>;  // a closed surface, looking in

bool IsSameRing(const CellFace& a, const CellFace& b) {
  if (a.count != b.count) return false;
  for (int shift = 0; shift < b.count; ++shift) {
    bool same = true;
    for (int j = 0; j < a.count && same; ++j) same = a.v[j] == b.v[(j + shift) % b.count];
    if (same) return true;
  }
  return false;
}

int IndexOf(const Walls& walls, const CellFace& face) {
  for (size_t i = 0; i < walls.size(); ++i) {
    if (IsSameRing(walls[i], face)) return static_cast<int>(i);
  }
  return -1;
}

// The wall that runs a -> b; -1 if there is none.
struct EdgeUse {
  int wall = -1;
  int at = 0;  // a is the wall's v[at]
};
EdgeUse WallAlong(const Walls& walls, int32_t a, int32_t b) {
  for (size_t i = 0; i < walls.size(); ++i) {
    const CellFace& wall = walls[i];
    for (int j = 0; j < wall.count; ++j) {
      if (wall.v[j] == a && wall.v[(j + 1) % wall.count] == b) return {static_cast<int>(i), j};
    }
  }
  return {};
}

// Cells that stand on the quad `base`: their top vertices come from the walls at its edges.
void AppendCellsOn(const Walls& walls, const CellFace& base, std::vector<CellCorners>* cells) {
  std::array<std::array<int32_t, 2>, 4> top;  // [edge] above its two ends
  unsigned known = 0;
  for (int e = 0; e < 4; ++e) {
    const int32_t a = base.v[e], b = base.v[(e + 1) % 4];
    const EdgeUse use = WallAlong(walls, b, a);
    if (use.wall < 0) continue;
    const CellFace& wall = walls[use.wall];
    top[e] = {wall.v[(use.at + 2) % wall.count], wall.v[(use.at + 3) % wall.count]};
    if (wall.count == 3) top[e][1] = top[e][0];
    known |= 1u << e;
  }
  for (unsigned mask = 1; mask < 16; ++mask) {
    if ((mask & known) != mask) continue;
    std::array<int32_t, 4> t = {-1, -1, -1, -1};
    bool consistent = true;
    for (int e = 0; e < 4; ++e) {
      if ((mask >> e & 1) == 0) continue;
      for (int end = 0; end < 2; ++end) {
        int32_t& vertex = t[(e + end) % 4];
        consistent = consistent && (vertex < 0 || vertex == top[e][end]);
        vertex = top[e][end];
      }
    }
    if (!consistent || *std::min_element(t.begin(), t.end()) < 0) continue;
    cells->push_back({base.v[0], base.v[1], base.v[2], base.v[3], t[0], t[1], t[2], t[3]});
  }
}

// Slices between `base` and a second quad that shares two successive edges with it.
void AppendSlicesOn(const Walls& walls, const CellFace& base, std::vector<CellCorners>* cells) {
  for (int e = 0; e < 4; ++e) {
    const int32_t a = base.v[e], b = base.v[(e + 1) % 4], c = base.v[(e + 2) % 4];
    const EdgeUse use = WallAlong(walls, c, b);
    if (use.wall < 0 || walls[use.wall].count != 4) continue;
    const auto& v = walls[use.wall].v;
    if (v[(use.at + 2) % 4] != a) continue;
    const int32_t d = v[(use.at + 3) % 4], own = base.v[(e + 3) % 4];
    cells->push_back({own, c, c, d, a, b, b, a});
  }
}

// One way to shrink a star by a cell.
struct Peel {
  int saved = 0;
  double quality = 0;
  CellCorners corners{};
  Walls rest;  // the walls that remain
};

// One star being taken apart.
class StarPeeler {
 public:
  StarPeeler(const WorkingMesh& mesh, int32_t apex, const std::vector<int>& star, StarFolds folds)
      : mesh_(mesh), star_(star), folds_(folds), apex_(mesh.vertices()[apex]) {
    for (const int cell : star) {
      floor_ = std::min(floor_, CellQuality(mesh.corners(cell), mesh.vertices()));
      for (const CellFace& face : FacesOf(mesh.corners(cell))) {
        const auto end = face.v.begin() + face.count;
        if (std::find(face.v.begin(), end, apex) != end) continue;
        walls_.push_back(Reversed(face));
        if (mesh.Across(face) == WorkingMesh::kHull) hull_.push_back(face);
      }
    }
  }

  bool Run() {
    while (!walls_.empty() && PeelOne()) {
    }
    return !cells_.empty();
  }

  void Apply(WorkingMesh* mesh) const {
    for (const int cell : star_) mesh->RemoveCell(cell);
    for (const CellCorners& corners : cells_) mesh->AddCell(corners);
    const int apex = walls_.empty() ? -1 : mesh->AddVertex(apex_);
    for (const CellFace& wall : walls_) {
      const CellFace out = Reversed(wall);
      mesh->AddCell(wall.count == 4 ? MakePyramid(out.v, apex)
                                    : MakeTetrahedronOn({out.v[0], out.v[1], out.v[2]}, apex));
    }
    for (const CellFace& face : hull_) mesh->MarkHull(face);
  }

 private:
  bool PeelOne() {
    std::vector<CellCorners> cells;
    for (const CellFace& wall : walls_) {
      if (wall.count != 4) continue;
      AppendCellsOn(walls_, wall, &cells);
      AppendSlicesOn(walls_, wall, &cells);
    }
    std::vector<Peel> peels;
    for (const CellCorners& corners : cells) {
      if (auto peel = Judge(corners)) peels.push_back(std::move(*peel));
    }
    std::stable_sort(peels.begin(), peels.end(), [](const Peel& a, const Peel& b) {
      return a.saved != b.saved ? a.saved > b.saved : a.quality > b.quality;
    });
    for (const Peel& peel : peels) {
      if (!RestIsGood(peel.rest)) continue;
      cells_.push_back(peel.corners);
      walls_ = peel.rest;
      return true;
    }
    return false;
  }

  double Floor() const { return std::min(floor_, kMinQuality); }

  std::optional<Peel> Judge(const CellCorners& corners) const {
    if (!RecognizeCell(corners)) return std::nullopt;
    Peel peel;
    peel.corners = corners;
    peel.rest = walls_;
    peel.saved = -1;
    for (const CellFace& face : FacesOf(corners)) {
      const int wall = IndexOf(peel.rest, Reversed(face));
      if (wall >= 0) {
        ++peel.saved;
        peel.rest.erase(peel.rest.begin() + wall);
      } else {
        --peel.saved;
        if (IsTaken(face)) return std::nullopt;
        peel.rest.push_back(face);
      }
    }
    if (peel.saved <= 0) return std::nullopt;
    peel.quality = CellQuality(corners, mesh_.vertices());
    if (peel.quality <= 0 || peel.quality < Floor()) return std::nullopt;
    return peel;
  }

  // True if a cell outside of the star has the face, either way around.
  bool IsTaken(const CellFace& face) const {
    const int half = mesh_.FindHalfFace(face);
    if (half < 0) return false;
    for (const int side : {half, half ^ 1}) {
      const int32_t owner = mesh_.owner(side);
      if (owner >= 0 && !std::binary_search(star_.begin(), star_.end(), owner)) return true;
    }
    return false;
  }

  // True if the rest is empty or a good star; moves the apex.
  bool RestIsGood(const Walls& rest) {
    if (rest.empty()) return true;
    Vec3d apex = apex_;
    const double quality = ImproveApex(rest, mesh_.vertices(), 0.25, &apex);
    if (quality <= 0 || quality < Floor() || (folds_ == StarFolds::kRefused && Folds(rest, apex)))
      return false;
    const double angle = SolidAngle(rest, apex, mesh_.vertices());
    if (std::abs(angle - 4 * std::numbers::pi) > kSolidAngleTolerance) return false;
    apex_ = apex;
    return true;
  }

  // True if a cell between a wall and the apex is seen from its middle as folding, which its
  // Jacobians alone do not tell: on a quad that is bent.
  bool Folds(const Walls& rest, const Vec3d& apex) const {
    return std::any_of(rest.begin(), rest.end(), [&](const CellFace& wall) {
      return StarFoldMargin(wall, apex, mesh_.vertices()) <= 0;
    });
  }

  const WorkingMesh& mesh_;
  const std::vector<int>& star_;  // ascending
  const StarFolds folds_;
  Vec3d apex_;
  double floor_ = 1;
  Walls walls_;
  std::vector<CellFace> hull_;  // outward
  std::vector<CellCorners> cells_;
};

bool IsPointed(PrimitiveType type) {
  return type == PrimitiveType::kPyramid || type == PrimitiveType::kTetrahedron;
}

// True if all cells at `v` are living pyramids and tetrahedra and v is not on the boundary.
bool IsApexInside(const WorkingMesh& mesh, int32_t v, const std::vector<int>& cells) {
  for (const int cell : cells) {
    if (!mesh.alive(cell) || !IsPointed(mesh.type(cell))) return false;
    for (const CellFace& face : FacesOf(mesh.corners(cell))) {
      const auto end = face.v.begin() + face.count;
      if (mesh.Across(face) < 0 && std::find(face.v.begin(), end, v) != end) return false;
    }
  }
  return !cells.empty();
}

}  // namespace

absl::StatusOr<CellComplex> PeelStars(const CellComplex& complex, StarFolds folds,
                                      const RunContext& run) {
  WorkingMesh mesh(complex);
  const auto cells_at = mesh.CellsAtVertices();
  int stars = 0;
  for (int32_t v = 0; v < static_cast<int32_t>(cells_at.size()); ++v) {
    if (!IsApexInside(mesh, v, cells_at[v])) continue;
    if (++stars % kStarsPerStopCheck == 0) {
      if (absl::Status status = run.CheckStop(); !status.ok()) return status;
    }
    StarPeeler peeler(mesh, v, cells_at[v], folds);
    if (peeler.Run()) peeler.Apply(&mesh);
  }
  return mesh.ToComplex();
}

}  // namespace amhex
