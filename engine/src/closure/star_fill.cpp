#include "closure/star_fill.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "closure/hull_apex.h"
#include "closure/hull_patch.h"
#include "closure/least_scores.h"
#include "input/hull_queries.h"

namespace amhex {
namespace {

constexpr double kCostPerFace = 1.1;
// A kernel shallower than this (edge lengths) is not worth a try.
constexpr double kMinKernelDepth = 0.01;
constexpr double kWantedKernelDepth = 0.2;
constexpr double kKernelWeight = 40;
// A hull face of an absorbed cell is kept if the apex sees it this well.
constexpr double kVisibleQuality = 0.12;
// Patch faces: allowed distance of their centre from the hull, and of a dropped hull vertex.
constexpr double kFreePatchDistance = 0.1;
constexpr double kFreeVertexDistance = 0.05;
constexpr double kDistanceWeight = 15;
// Patch normals must agree with the hull's: a patch that folds over makes the mesh overlap itself.
constexpr double kPatchNormalCosine = 0.3;
constexpr double kNormalWeight = 25;
constexpr double kNormalCheckDistance = 0.3;

double DistanceToTriangle(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d ab = b - a, ac = c - a, ap = p - a;
  const double d1 = Dot(ab, ap), d2 = Dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return Norm(ap);
  const Vec3d bp = p - b;
  const double d3 = Dot(ab, bp), d4 = Dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return Norm(bp);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return Norm(ap - ab * (d1 / (d1 - d3)));
  const Vec3d cp = p - c;
  const double d5 = Dot(ab, cp), d6 = Dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return Norm(cp);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return Norm(ap - ac * (d2 / (d2 - d6)));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    return Norm(bp - (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))));
  }
  return std::abs(Dot(ap, Normalized(Cross(ab, ac))));
}

using Polygon = std::vector<Vec3d>;

std::vector<Polygon> PolygonsOf(const std::vector<CellFace>& faces, const std::vector<Vec3d>& x) {
  std::vector<Polygon> polygons;
  for (const CellFace& face : faces) {
    Polygon& polygon = polygons.emplace_back();
    for (int j = 0; j < face.count; ++j) polygon.push_back(x[face.v[j]]);
  }
  return polygons;
}

// What a patch (looking in) costs for leaving the hull, folding over it or cutting off former hull
// vertices. `kept`: faces whose vertices are not cut off.
double PatchDeviation(const WorkingMesh& mesh, const Hull& hull, const std::vector<Polygon>& patch,
                      const std::vector<CellFace>& kept_faces,
                      const std::vector<CellFace>& dropped) {
  const auto& x = mesh.vertices();
  double cost = 0;
  for (const Polygon& p : patch) {
    Vec3d centre;
    for (const Vec3d& corner : p) centre += corner;
    const HullPoint nearest = hull.queries->Closest(centre / static_cast<double>(p.size()));
    cost += kDistanceWeight * std::max(0.0, nearest.distance - kFreePatchDistance);
    if (nearest.distance < kNormalCheckDistance) {
      const double cosine = -Dot(Normalized(Cross(p[1] - p[0], p[2] - p[0])), nearest.normal);
      cost += kNormalWeight * std::max(0.0, kPatchNormalCosine - cosine);
    }
  }
  std::set<int32_t> kept, cut_off;
  for (const CellFace& face : kept_faces) kept.insert(face.v.begin(), face.v.begin() + face.count);
  for (const CellFace& face : dropped) {
    for (int j = 0; j < face.count; ++j) {
      if (!kept.contains(face.v[j])) cut_off.insert(face.v[j]);
    }
  }
  for (const int32_t v : cut_off) {
    double distance = 1e9;
    for (const Polygon& p : patch) {
      for (size_t s = 0; s + 2 < p.size(); ++s) {
        distance = std::min(distance, DistanceToTriangle(x[v], p[0], p[1 + s], p[2 + s]));
      }
    }
    cost += kDistanceWeight * std::max(0.0, distance - kFreeVertexDistance);
  }
  return cost;
}

double AbsorbedCost(const WorkingMesh& mesh, const FillWeights& weights, const Region& region) {
  double cost = 0;
  for (const int cell : region.cells) {
    cost += mesh.is_hexahedron(cell) ? weights.hexahedron_lost : weights.other_removed;
  }
  return cost;
}

// Tries one star over `fixed` faces; the loops they leave open are closed by patches.
void TryStar(const WorkingMesh& mesh, const Hull& hull, const Region& region,
             const std::vector<CellFace>& fixed, const std::vector<CellFace>& dropped,
             const FillWeights& weights, StarFilling* best) {
  const auto loops = BoundaryLoops(fixed);
  for (const auto& loop : loops) {
    if (loop.size() < 3) return;
  }
  const double base_cost = AbsorbedCost(mesh, weights, region);
  // Of a star on so many faces, however good its cells and however near its patch to the hull.
  const auto cost_of = [&](size_t faces) {
    return base_cost + kCostPerFace * static_cast<double>(faces) + 1;
  };
  size_t least_faces = fixed.size();
  for (const auto& loop : loops) least_faces += LeastPatchFaces(loop.size());
  if (cost_of(least_faces) >= best->cost) return;
  StarFilling filling;
  filling.apex = region.kernel.point;
  // The patch depends on the apex and the apex on the patch: two rounds settle both.
  const int rounds = loops.empty() ? 1 : 2;
  for (int round = 0; round < rounds; ++round) {
    filling.patch.clear();
    for (const auto& loop : loops) {
      const auto patch = FindHullPatch(mesh, hull, {region.cells, loop, filling.apex});
      if (!patch) return;
      filling.patch.insert(filling.patch.end(), patch->faces.begin(), patch->faces.end());
    }
    filling.faces = fixed;
    filling.faces.insert(filling.faces.end(), filling.patch.begin(), filling.patch.end());
    if (round + 1 == rounds && cost_of(filling.faces.size()) >= best->cost) return;
    filling.quality =
        ImproveApex(filling.faces, mesh.vertices(), round == 0 ? 0.25 : 0.1, &filling.apex);
    if (filling.quality <= 0) return;
  }
  const double solid_angle = SolidAngle(filling.faces, filling.apex, mesh.vertices());
  if (std::abs(solid_angle - 4 * std::numbers::pi) > kSolidAngleTolerance) return;
  if (HasRepeatedFace(filling.faces)) return;
  filling.cost = cost_of(filling.faces.size()) + QualityPenalty(weights, filling.quality);
  if (filling.cost >= best->cost) return;
  filling.cost += PatchDeviation(mesh, hull, PolygonsOf(filling.patch, mesh.vertices()),
                                 filling.faces, dropped);
  if (filling.cost >= best->cost) return;
  if (RunsThroughCells(mesh, filling.patch, region.cells)) return;
  filling.region = region;
  *best = std::move(filling);
}

// Tries the star over the walls whose apex lies on the hull.
void TryHullStar(const WorkingMesh& mesh, const Hull& hull, const Region& region,
                 const FillWeights& weights, StarFilling* best) {
  const auto loops = BoundaryLoops(region.walls);
  if (loops.size() != 1 || loops[0].size() < 3) return;
  StarFilling filling;
  filling.cost = AbsorbedCost(mesh, weights, region) +
                 kCostPerFace * static_cast<double>(region.walls.size()) + 1;
  if (filling.cost >= best->cost) return;
  const auto apex = FindHullApex(mesh, hull, region.walls, loops[0], region.kernel.point);
  if (!apex) return;
  filling.apex = apex->point;
  filling.quality = apex->quality;
  filling.faces = region.walls;
  filling.rim = loops[0];
  if (HasRepeatedFace(filling.faces)) return;
  const auto& x = mesh.vertices();
  std::vector<Polygon> patch;
  for (size_t i = 0; i < filling.rim.size(); ++i) {
    patch.push_back({x[filling.rim[i]], x[filling.rim[(i + 1) % filling.rim.size()]], apex->point});
  }
  filling.cost += QualityPenalty(weights, filling.quality) +
                  PatchDeviation(mesh, hull, patch, filling.faces, region.hull_faces);
  if (filling.cost >= best->cost) return;
  filling.region = region;
  *best = std::move(filling);
}

// How promising a region is, before any star has been tried, is its bound and what its kernel
// lacks.
double ScoreBound(const WorkingMesh& mesh, const FillWeights& weights, const Region& region) {
  return AbsorbedCost(mesh, weights, region) +
         kCostPerFace * static_cast<double>(region.walls.size());
}

struct Candidate {
  double bound;  // of the score
  Region region;
};

constexpr double kRejected = 1e300;
// Candidates whose kernels are sought side by side.
constexpr size_t kKernelsAtOnce = 16;
// The least score that is still asked for may be off by rounding.
constexpr double kDepthSlack = 1e-9;

// Every region of the beam with one neighbour more, each set of cells once.
std::vector<Candidate> NextCandidates(const WorkingMesh& mesh, const std::vector<Candidate>& beam,
                                      std::set<std::vector<int>>* seen) {
  std::vector<Candidate> next;
  for (const Candidate& candidate : beam) {
    for (const int cell : CellsAround(mesh, candidate.region)) {
      Region grown;
      grown.cells = candidate.region.cells;
      grown.cells.insert(std::lower_bound(grown.cells.begin(), grown.cells.end(), cell), cell);
      if (!seen->insert(grown.cells).second) continue;
      grown.cavities = candidate.region.cavities;
      next.push_back({kRejected, std::move(grown)});
    }
  }
  return next;
}

// Walls and bounds; candidates that break a limit are dropped. Each is judged on its own, so that
// the result does not depend on the number of threads.
void BoundCandidates(const WorkingMesh& mesh, const Cavities& cavities, const FillWeights& weights,
                     const GrowthLimits& limits, std::vector<Candidate>* candidates) {
  oneapi::tbb::parallel_for(size_t{0}, candidates->size(), [&](size_t i) {
    Region& region = (*candidates)[i].region;
    if (!UpdateRegion(mesh, cavities, limits.max_walls, &region)) return;
    if (limits.forbid_cavities && !region.cavities.empty()) return;
    (*candidates)[i].bound = ScoreBound(mesh, weights, region);
  });
  std::erase_if(*candidates, [](const Candidate& c) { return c.bound == kRejected; });
}

// The most promising ones, with their kernels.
std::vector<Candidate> KeepBest(const WorkingMesh& mesh, const Hull& hull, size_t width,
                                std::vector<Candidate> candidates) {
  std::vector<double> bounds;
  bounds.reserve(candidates.size());
  for (const Candidate& candidate : candidates) bounds.push_back(candidate.bound);
  const auto score = [&](const std::vector<size_t>& some, double most,
                         std::vector<double>* scores) {
    oneapi::tbb::parallel_for(size_t{0}, some.size(), [&](size_t i) {
      Candidate& candidate = candidates[some[i]];
      const double least_depth = kWantedKernelDepth - (most - candidate.bound) / kKernelWeight;
      UpdateKernel(mesh, hull, least_depth - kDepthSlack, &candidate.region);
      (*scores)[i] =
          candidate.bound +
          kKernelWeight * std::max(0.0, kWantedKernelDepth - candidate.region.kernel.depth);
    });
  };
  std::vector<Candidate> best;
  for (const size_t i : LeastScores(bounds, width, kKernelsAtOnce, score)) {
    best.push_back(std::move(candidates[i]));
  }
  return best;
}

}  // namespace

bool HasRepeatedFace(const std::vector<CellFace>& faces) {
  std::set<std::array<int32_t, 4>> seen;
  for (const CellFace& face : faces) {
    std::array<int32_t, 4> key = face.v;
    std::sort(key.begin(), key.end());
    if (!seen.insert(key).second) return true;
  }
  return false;
}

double QualityPenalty(const FillWeights& weights, double quality) {
  return weights.poor_quality * std::max(0.0, weights.good_quality - std::max(0.0, quality));
}

void EvaluateRegion(const WorkingMesh& mesh, const Hull& hull, const FillWeights& weights,
                    const Region& region, StarFilling* best) {
  if (region.walls.empty() || region.kernel.depth <= kMinKernelDepth) return;
  std::vector<CellFace> fixed = region.walls;
  std::vector<CellFace> dropped;
  for (const CellFace& face : region.hull_faces) {
    const bool visible = StarQuality(face, region.kernel.point, mesh.vertices()) > kVisibleQuality;
    (visible ? fixed : dropped).push_back(face);
  }
  const size_t kept_count = fixed.size() - region.walls.size();
  StarFilling candidate = *best;
  TryStar(mesh, hull, region, fixed, dropped, weights, &candidate);
  // The kept faces are part of the hull as well.
  const auto finish = [&](const std::vector<CellFace>& kept) {
    if (candidate.cost >= best->cost) return;
    candidate.patch.insert(candidate.patch.end(), kept.begin(), kept.end());
    *best = candidate;
  };
  finish({fixed.begin() + static_cast<std::ptrdiff_t>(region.walls.size()), fixed.end()});
  if (!region.hull_faces.empty() && kept_count > 0) {
    candidate = *best;
    TryStar(mesh, hull, region, region.walls, region.hull_faces, weights, &candidate);
    finish({});
  }
  TryHullStar(mesh, hull, region, weights, best);
}

std::optional<StarFilling> GrowStar(const WorkingMesh& mesh, const Hull& hull,
                                    const Cavities& cavities, const FillWeights& weights,
                                    const GrowthLimits& limits, std::vector<Region> seeds,
                                    double cost_to_beat) {
  StarFilling best;
  best.cost = cost_to_beat;
  const auto settled = [&] {
    return best.cost < cost_to_beat && best.quality >= limits.enough_quality;
  };
  std::vector<Candidate> beam;
  for (Region& seed : seeds) {
    if (!UpdateRegion(mesh, cavities, limits.max_walls, &seed)) continue;
    UpdateKernel(mesh, hull, -1e300, &seed);
    if (seed.kernel.depth < limits.min_seed_depth) continue;
    EvaluateRegion(mesh, hull, weights, seed, &best);
    beam.push_back({0, std::move(seed)});
  }
  std::set<std::vector<int>> seen;
  int rounds_without_gain = 0;
  for (int depth = 1; depth <= limits.depth; ++depth) {
    if (limits.run != nullptr && limits.run->ShouldStop()) return std::nullopt;
    std::vector<Candidate> next = NextCandidates(mesh, beam, &seen);
    BoundCandidates(mesh, cavities, weights, limits, &next);
    if (next.empty()) break;
    beam = KeepBest(mesh, hull, static_cast<size_t>(limits.beam_width), std::move(next));
    const double before = best.cost;
    for (const Candidate& candidate : beam) {
      EvaluateRegion(mesh, hull, weights, candidate.region, &best);
    }
    rounds_without_gain = best.cost < before - 1e-9 ? 0 : rounds_without_gain + 1;
    if (settled() && rounds_without_gain >= 2) break;
    if (best.cost < cost_to_beat && rounds_without_gain >= 4) break;
  }
  if (best.cost >= cost_to_beat || best.faces.empty()) return std::nullopt;
  return best;
}

int ApplyStar(const StarFilling& filling, WorkingMesh* mesh) {
  for (const int cell : filling.region.cells) mesh->RemoveCell(cell);
  const int apex = mesh->AddVertex(filling.apex);
  for (const CellFace& face : filling.faces) {
    const CellFace out = Reversed(face);
    if (face.count == 4) {
      mesh->AddCell(MakePyramid(out.v, apex));
    } else {
      mesh->AddCell(MakeTetrahedronOn({out.v[0], out.v[1], out.v[2]}, apex));
    }
  }
  for (const CellFace& face : filling.patch) mesh->MarkHull(Reversed(face));
  for (size_t i = 0; i < filling.rim.size(); ++i) {
    const int32_t next = filling.rim[(i + 1) % filling.rim.size()];
    mesh->MarkHull({3, {next, filling.rim[i], apex, -1}});
  }
  return apex;
}

}  // namespace amhex
