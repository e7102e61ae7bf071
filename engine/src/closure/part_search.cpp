#include "closure/part_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/sort_unique.h"
#include "closure/cavities.h"
#include "closure/hull_patch.h"
#include "closure/least_scores.h"
#include "closure/star_fill.h"

namespace amhex {
namespace {

constexpr size_t kBeamWidth = 4;
// Depths without a better star after which a part with a good one grows no more.
constexpr int kPatience = 2;
constexpr size_t kMaxWalls = 70;
constexpr double kCostPerFace = 1.1;
// A membrane face is left to another star: about what closing it will cost.
constexpr double kMembraneCost = 1.5;
constexpr double kHexahedronLost = 1.0;
constexpr double kOtherRemoved = -0.9;
constexpr double kMinKernelDepth = 0.02;
constexpr double kWantedKernelDepth = 0.2;
constexpr double kKernelWeight = 40;
// The least score that is still asked for may be off by rounding.
constexpr double kDepthSlack = 1e-9;
constexpr double kVisibleQuality = 0.12;

}  // namespace

void PartSearch::Run(const std::vector<CellFace>& faces, const std::vector<int>& part) {
  faces_.clear();
  closed_.clear();
  for (const int i : part) {
    const int half = mesh_.FindHalfFace(faces[i]);
    faces_.push_back({faces[i], mesh_.owner(half)});
    closed_.push_back(half);
  }
  std::sort(closed_.begin(), closed_.end());
  std::vector<Part> beam(1);
  if (!Update(&beam[0])) return;
  FindKernelOf(&beam[0], -1e300);
  Evaluate(beam[0]);
  std::set<std::vector<int>> seen;
  int depths_without_gain = 0;
  for (int depth = 0; depth < limits_.depth && depths_without_gain < kPatience; ++depth) {
    beam = Grow(beam, &seen);
    const double before = best_.cost_per_face;
    for (const Part& candidate : beam) Evaluate(candidate);
    const bool found = best_.cost_per_face <= limits_.max_cost_per_face;
    depths_without_gain = !found || best_.cost_per_face < before ? 0 : depths_without_gain + 1;
  }
}

std::vector<PartSearch::Part> PartSearch::Grow(const std::vector<Part>& beam,
                                               std::set<std::vector<int>>* seen) {
  std::vector<Part> next;
  for (const Part& part : beam) {
    std::vector<int> around;
    for (const Wall& wall : part.walls) around.push_back(wall.owner);
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    for (const int cell : around) {
      Part grown;
      grown.cells = part.cells;
      grown.cells.insert(std::lower_bound(grown.cells.begin(), grown.cells.end(), cell), cell);
      if (seen->insert(grown.cells).second && Update(&grown)) next.push_back(std::move(grown));
    }
  }
  return KeepBest(std::move(next));
}

// The most promising ones, with their kernels.
std::vector<PartSearch::Part> PartSearch::KeepBest(std::vector<Part> parts) {
  std::vector<double> bounds;
  bounds.reserve(parts.size());
  for (const Part& part : parts) bounds.push_back(part.bound);
  const auto score = [&](const std::vector<size_t>& some, double most,
                         std::vector<double>* scores) {
    for (size_t i = 0; i < some.size(); ++i) {
      Part& part = parts[some[i]];
      FindKernelOf(&part, kWantedKernelDepth - (most - part.bound) / kKernelWeight - kDepthSlack);
      (*scores)[i] =
          part.bound + kKernelWeight * std::max(0.0, kWantedKernelDepth - part.kernel.depth);
    }
  };
  std::vector<Part> best;
  for (const size_t i : LeastScores(bounds, kBeamWidth, 1, score)) {
    best.push_back(std::move(parts[i]));
  }
  return best;
}

bool PartSearch::Update(Part* part) {
  ++part_count_;
  for (const Wall& open : faces_) {
    if (!IsAmong(part->cells, open.owner)) part->walls.push_back(open);
  }
  for (const int cell : part->cells) {
    const CellFaces faces = FacesOf(mesh_.corners(cell));
    for (int i = 0; i < faces.count; ++i) {
      const CellFace& face = faces.face[i];
      const int half = mesh_.half_faces(cell)[i];
      const int32_t behind = mesh_.owner(half ^ 1);
      if (behind >= 0) {
        if (!IsAmong(part->cells, behind)) part->walls.push_back({Reversed(face), behind});
      } else if (behind == WorkingMesh::kHull) {
        part->hull_faces.push_back(Reversed(face));
      } else if (!IsAmong(closed_, half)) {
        part->kept_open.push_back(Reversed(face));
      }
    }
  }
  if (part->walls.empty() || part->walls.size() > kMaxWalls) return false;
  part->bound = AbsorbedCost(*part) + kCostPerFace * static_cast<double>(part->walls.size());
  return true;
}

// `hopeless` as of FindKernel.
void PartSearch::FindKernelOf(Part* part, double hopeless) {
  const auto& x = mesh_.vertices();
  planes_.clear();
  Vec3d start;
  int count = 0;
  const auto add = [&](const CellFace& face) {
    const std::vector<KernelPlane>& own = PlanesOf(face);
    planes_.insert(planes_.end(), own.begin(), own.end());
    for (int j = 0; j < face.count; ++j) start += x[face.v[j]], ++count;
  };
  for (const Wall& wall : part->walls) add(wall.face);
  for (const CellFace& face : part->kept_open) add(face);
  part->kernel = FindKernel(planes_, start / count, hopeless);
}
// Hundreds of parts share their faces.
const std::vector<KernelPlane>& PartSearch::PlanesOf(const CellFace& face) {
  std::vector<KernelPlane>& planes = planes_of_[face.v];
  if (planes.empty()) AppendKernelPlanes(face, mesh_.vertices(), &planes);
  return planes;
}

double PartSearch::AbsorbedCost(const Part& part) const {
  double cost = 0;
  for (const int cell : part.cells) {
    cost += mesh_.is_hexahedron(cell) ? kHexahedronLost : kOtherRemoved;
  }
  return cost;
}

void PartSearch::Evaluate(const Part& part) {
  if (part.kernel.depth <= kMinKernelDepth) return;
  Carving carving;
  carving.cells = part.cells;
  carving.closed = closed_;
  carving.apex = part.kernel.point;
  std::vector<CellFace> fixed;
  fixed.reserve(part.walls.size());
  for (const Wall& wall : part.walls) fixed.push_back(wall.face);
  fixed.insert(fixed.end(), part.kept_open.begin(), part.kept_open.end());
  std::vector<CellFace> hull;
  for (const CellFace& face : part.hull_faces) {
    if (StarQuality(face, carving.apex, mesh_.vertices()) > kVisibleQuality) hull.push_back(face);
  }
  fixed.insert(fixed.end(), hull.begin(), hull.end());
  if (!Close(part, fixed, &carving)) return;
  int membranes = 0;
  carving.hull = hull;
  for (size_t i = fixed.size(); i < carving.faces.size(); ++i) {
    if (FollowsHull(hull_, carving.faces[i], mesh_.vertices())) {
      carving.hull.push_back(carving.faces[i]);
    } else {
      ++membranes;
    }
  }
  const double quality = MinStarQuality(carving.faces, carving.apex, mesh_.vertices());
  const int closed = static_cast<int>(closed_.size()) - membranes;
  if (quality < limits_.min_quality || closed <= 0) return;
  const double cost = CostOfFaces(part, carving.faces.size()) +
                      QualityPenalty(FillWeights{}, quality) + kMembraneCost * membranes;
  carving.cost_per_face = cost / closed;
  if (carving.cost_per_face < best_.cost_per_face) best_ = std::move(carving);
}

// Of a star that stands on so many faces, however good its cells and without membranes.
double PartSearch::CostOfFaces(const Part& part, size_t faces) const {
  return AbsorbedCost(part) + kCostPerFace * static_cast<double>(faces) + 1;
}

// True if no star on so many faces or more could become the best, or be worth it. A sum that
// rounds is no less for larger terms, so what this leaves out makes no difference.
bool PartSearch::IsHopeless(const Part& part, size_t faces) const {
  const double cost = CostOfFaces(part, faces);
  const double per_face = cost / static_cast<double>(closed_.size());
  return cost > 0 && (per_face >= best_.cost_per_face || per_face > limits_.max_cost_per_face);
}

// Closes the loops of `fixed` by patches; the patch depends on the apex and the apex on the
// patch: two rounds settle both. False if that makes no star, or none that is worth it.
bool PartSearch::Close(const Part& part, const std::vector<CellFace>& fixed,
                       Carving* carving) const {
  if (IsHopeless(part, fixed.size())) return false;
  const auto loops = BoundaryLoops(fixed);
  size_t least_faces = fixed.size();
  for (const auto& loop : loops) least_faces += LeastPatchFaces(loop.size());
  if (IsHopeless(part, least_faces)) return false;
  for (int round = 0; round < 2; ++round) {
    carving->faces = fixed;
    for (const auto& loop : loops) {
      const auto patch =
          FindHullPatch(mesh_, hull_, {carving->cells, loop, carving->apex, PatchKind::kMembrane});
      if (!patch) return false;
      carving->faces.insert(carving->faces.end(), patch->faces.begin(), patch->faces.end());
    }
    if (round == 1 && IsHopeless(part, carving->faces.size())) return false;
    const double first_step = round == 0 ? 0.25 : 0.1;
    if (ImproveApex(carving->faces, mesh_.vertices(), first_step, &carving->apex) <= 0) {
      return false;
    }
  }
  const double angle = SolidAngle(carving->faces, carving->apex, mesh_.vertices());
  return std::abs(angle - 4 * std::numbers::pi) <= kSolidAngleTolerance &&
         !HasRepeatedFace(carving->faces);
}

}  // namespace amhex
