#include "closure/star_peeler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "closure/star_geometry.h"
#include "optimize/cell_quality.h"

namespace amhex {
namespace {

// New cells must be this good, or no worse than the worst that they replace.
constexpr double kMinQuality = 0.1;

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

}  // namespace

struct StarPeeler::Peel {
  int saved = 0;
  double quality = 0;
  CellCorners corners{};
  Walls rest;  // the walls that remain
};

StarSurface SurfaceOf(const WorkingMesh& mesh, int32_t apex, const std::vector<int>& star) {
  StarSurface surface{star, {}, {}};
  for (const int cell : star) {
    for (const CellFace& face : FacesOf(mesh.corners(cell))) {
      const auto end = face.v.begin() + face.count;
      if (std::find(face.v.begin(), end, apex) != end) continue;
      surface.walls.push_back(Reversed(face));
      if (mesh.Across(face) == WorkingMesh::kHull) surface.hull.push_back(face);
    }
  }
  return surface;
}

StarPeeler::StarPeeler(const WorkingMesh& mesh, StarSurface surface, const Vec3d& apex,
                       StarFolds folds)
    : mesh_(&mesh), surface_(std::move(surface)), apex_(apex), folds_(folds) {
  for (const int cell : surface_.cells) {
    floor_ = std::min(floor_, CellQuality(mesh.corners(cell), mesh.vertices()));
  }
}

bool StarPeeler::Run() {
  while (!surface_.walls.empty() && PeelOne()) {
  }
  return !cells_.empty();
}

double StarPeeler::Loss() const {
  double loss = 0;
  for (const CellCorners& corners : cells_) loss += 1 - CellQuality(corners, mesh_->vertices());
  for (const CellFace& wall : surface_.walls)
    loss += 1 - StarQuality(wall, apex_, mesh_->vertices());
  return loss;
}

void StarPeeler::Apply(WorkingMesh* mesh) const {
  for (const int cell : surface_.cells) mesh->RemoveCell(cell);
  for (const CellCorners& corners : cells_) mesh->AddCell(corners);
  const int apex = surface_.walls.empty() ? -1 : mesh->AddVertex(apex_);
  for (const CellFace& wall : surface_.walls) {
    const CellFace out = Reversed(wall);
    mesh->AddCell(wall.count == 4 ? MakePyramid(out.v, apex)
                                  : MakeTetrahedronOn({out.v[0], out.v[1], out.v[2]}, apex));
  }
  for (const CellFace& face : surface_.hull) mesh->MarkHull(face);
}

bool StarPeeler::PeelOne() {
  std::vector<CellCorners> cells;
  for (const CellFace& wall : surface_.walls) {
    if (wall.count != 4) continue;
    AppendCellsOn(surface_.walls, wall, &cells);
    AppendSlicesOn(surface_.walls, wall, &cells);
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
    surface_.walls = peel.rest;
    return true;
  }
  return false;
}

double StarPeeler::Floor() const { return std::min(floor_, kMinQuality); }

std::optional<StarPeeler::Peel> StarPeeler::Judge(const CellCorners& corners) const {
  if (!RecognizeCell(corners)) return std::nullopt;
  Peel peel;
  peel.corners = corners;
  peel.rest = surface_.walls;
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
  peel.quality = CellQuality(corners, mesh_->vertices());
  if (peel.quality <= 0 || peel.quality < Floor()) return std::nullopt;
  return peel;
}

// True if a cell outside of the star has the face, either way around.
bool StarPeeler::IsTaken(const CellFace& face) const {
  const int half = mesh_->FindHalfFace(face);
  if (half < 0) return false;
  for (const int side : {half, half ^ 1}) {
    const int32_t owner = mesh_->owner(side);
    if (owner >= 0 && !std::binary_search(surface_.cells.begin(), surface_.cells.end(), owner))
      return true;
  }
  return false;
}

// True if the rest is empty or a good star; moves the apex.
bool StarPeeler::RestIsGood(const Walls& rest) {
  if (rest.empty()) return true;
  Vec3d apex = apex_;
  const double quality = ImproveApex(rest, mesh_->vertices(), 0.25, &apex);
  if (quality <= 0 || quality < Floor() || (folds_ == StarFolds::kRefused && Folds(rest, apex)))
    return false;
  const double angle = SolidAngle(rest, apex, mesh_->vertices());
  if (std::abs(angle - 4 * std::numbers::pi) > kSolidAngleTolerance) return false;
  apex_ = apex;
  return true;
}

// True if a cell between a wall and the apex is seen from its middle as folding, which its
// Jacobians alone do not tell: on a quad that is bent.
bool StarPeeler::Folds(const Walls& rest, const Vec3d& apex) const {
  return std::any_of(rest.begin(), rest.end(), [&](const CellFace& wall) {
    return StarFoldMargin(wall, apex, mesh_->vertices()) <= 0;
  });
}

}  // namespace amhex
