#include "closure/carve.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>
#include <vector>

#include "closure/cavities.h"
#include "closure/cavity_parts.h"
#include "closure/hull_patch.h"
#include "closure/least_scores.h"
#include "closure/star_fill.h"
#include "closure/star_geometry.h"
#include "input/hull_queries.h"

namespace amhex {
namespace {

// Parts of a network: open faces whose centres are this near to a seed's, in edge lengths.
constexpr double kRadii[] = {0.85, 1.3, 2.0};
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

// A star over part of a cavity, not yet applied.
struct Carving {
  double cost_per_face = 1e9;
  Vec3d apex;
  std::vector<int> cells;       // absorbed, ascending
  std::vector<CellFace> faces;  // all that the star stands on, looking in
  std::vector<CellFace> hull;   // those of them that become hull
  std::vector<int> closed;      // half-faces of the part
};

// A set of absorbed cells and the walls of the void that they and the part leave.
struct Part {
  double bound = 0;  // of its score, whatever its kernel
  std::vector<int> cells;
  std::vector<CellFace> walls;       // looking in
  std::vector<CellFace> kept_open;   // open faces of absorbed cells outside of the part, looking in
  std::vector<CellFace> hull_faces;  // former hull faces of absorbed cells, looking in
  KernelPoint kernel;
};

bool Contains(const std::vector<int>& sorted, int value) {
  return std::binary_search(sorted.begin(), sorted.end(), value);
}

// Finds the best carving around one open face.
class PartSearch {
 public:
  PartSearch(const WorkingMesh& mesh, const Hull& hull, const CarveLimits& limits)
      : mesh_(mesh), hull_(hull), limits_(limits) {}

  // `faces`: open faces of one cavity; `part`: indices of those to close.
  void Run(const std::vector<CellFace>& faces, const std::vector<int>& part) {
    faces_.clear();
    closed_.clear();
    for (const int i : part) {
      faces_.push_back(faces[i]);
      closed_.push_back(mesh_.FindHalfFace(faces[i]));
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

  const Carving& best() const { return best_; }
  int64_t part_count() const { return part_count_; }

 private:
  std::vector<Part> Grow(const std::vector<Part>& beam, std::set<std::vector<int>>* seen) {
    std::vector<Part> next;
    for (const Part& part : beam) {
      std::vector<int> around;
      for (const CellFace& face : part.walls) around.push_back(mesh_.Owner(face));
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
  std::vector<Part> KeepBest(std::vector<Part> parts) const {
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

  bool Update(Part* part) {
    ++part_count_;
    for (const CellFace& face : faces_) {
      if (!Contains(part->cells, mesh_.Owner(face))) part->walls.push_back(face);
    }
    for (const int cell : part->cells) {
      const CellFaces faces = FacesOf(mesh_.corners(cell));
      for (int i = 0; i < faces.count; ++i) {
        const CellFace& face = faces.face[i];
        const int half = mesh_.half_faces(cell)[i];
        const int32_t behind = mesh_.owner(half ^ 1);
        if (behind >= 0) {
          if (!Contains(part->cells, behind)) part->walls.push_back(Reversed(face));
        } else if (behind == WorkingMesh::kHull) {
          part->hull_faces.push_back(Reversed(face));
        } else if (!Contains(closed_, half)) {
          part->kept_open.push_back(Reversed(face));
        }
      }
    }
    if (part->walls.empty() || part->walls.size() > kMaxWalls) return false;
    part->bound = AbsorbedCost(*part) + kCostPerFace * static_cast<double>(part->walls.size());
    return true;
  }

  // `hopeless` as of FindKernel.
  void FindKernelOf(Part* part, double hopeless) const {
    const auto& x = mesh_.vertices();
    std::vector<KernelPlane> planes;
    Vec3d start;
    int count = 0;
    for (const auto* faces : {&part->walls, &part->kept_open}) {
      for (const CellFace& face : *faces) {
        AppendKernelPlanes(face, x, &planes);
        for (int j = 0; j < face.count; ++j) start += x[face.v[j]], ++count;
      }
    }
    part->kernel = FindKernel(planes, start / count, hopeless);
  }

  double AbsorbedCost(const Part& part) const {
    double cost = 0;
    for (const int cell : part.cells) {
      cost += mesh_.is_hexahedron(cell) ? kHexahedronLost : kOtherRemoved;
    }
    return cost;
  }

  void Evaluate(const Part& part) {
    if (part.kernel.depth <= kMinKernelDepth) return;
    Carving carving;
    carving.cells = part.cells;
    carving.closed = closed_;
    carving.apex = part.kernel.point;
    std::vector<CellFace> fixed = part.walls;
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
  double CostOfFaces(const Part& part, size_t faces) const {
    return AbsorbedCost(part) + kCostPerFace * static_cast<double>(faces) + 1;
  }

  // True if no star on so many faces or more could become the best, or be worth it. A sum that
  // rounds is no less for larger terms, so what this leaves out makes no difference.
  bool IsHopeless(const Part& part, size_t faces) const {
    const double cost = CostOfFaces(part, faces);
    const double per_face = cost / static_cast<double>(closed_.size());
    return cost > 0 && (per_face >= best_.cost_per_face || per_face > limits_.max_cost_per_face);
  }

  // Closes the loops of `fixed` by patches; the patch depends on the apex and the apex on the
  // patch: two rounds settle both. False if that makes no star, or none that is worth it.
  bool Close(const Part& part, const std::vector<CellFace>& fixed, Carving* carving) const {
    if (IsHopeless(part, fixed.size())) return false;
    const auto loops = BoundaryLoops(fixed);
    size_t least_faces = fixed.size();
    for (const auto& loop : loops) least_faces += LeastPatchFaces(loop.size());
    if (IsHopeless(part, least_faces)) return false;
    for (int round = 0; round < 2; ++round) {
      carving->faces = fixed;
      for (const auto& loop : loops) {
        const auto patch = FindHullPatch(
            mesh_, hull_, {carving->cells, loop, carving->apex, PatchKind::kMembrane});
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

  const WorkingMesh& mesh_;
  const Hull& hull_;
  const CarveLimits& limits_;
  std::vector<CellFace> faces_;
  std::vector<int> closed_;
  Carving best_;
  int64_t part_count_ = 0;
};

bool IsStillPossible(const WorkingMesh& mesh, const Carving& carving) {
  for (const int cell : carving.cells) {
    if (!mesh.alive(cell)) return false;
  }
  for (const int half : carving.closed) {
    if (mesh.owner(half) < 0 || mesh.owner(half ^ 1) != WorkingMesh::kOpen) return false;
  }
  // No new face may be taken by a cell that stays.
  for (const CellFace& face : carving.faces) {
    const int half = mesh.FindHalfFace(face);
    if (half < 0) continue;
    const int32_t behind = mesh.owner(half ^ 1);
    if (behind >= 0 && !Contains(carving.cells, behind)) return false;
  }
  return true;
}

void Apply(const Carving& carving, WorkingMesh* mesh) {
  StarFilling filling;
  filling.apex = carving.apex;
  filling.region.cells = carving.cells;
  filling.faces = carving.faces;
  filling.patch = carving.hull;
  ApplyStar(filling, mesh);
}

// The searches of all seeds in one cavity.
class CavityCarver {
 public:
  CavityCarver(const std::vector<CellFace>& faces, const Hull& hull, const WorkingMesh& mesh)
      : faces_(faces), hull_(hull), mesh_(mesh), neighbours_(FaceNeighbours(faces)) {
    for (const CellFace& face : faces) {
      centres_.push_back(FaceCentroid(face, mesh.vertices()));
      halves_.push_back(mesh.FindHalfFace(face));
    }
  }

  // Appends what is worth it to `found`; notes in `memory` where nothing is.
  void Search(const CarveLimits& limits, const RunContext& run, CarveMemory* memory,
              std::vector<Carving>* found) const {
    std::vector<Seed> seeds(faces_.size());
    oneapi::tbb::parallel_for(size_t{0}, faces_.size(), [&](size_t i) {
      if (!run.ShouldStop()) seeds[i] = SeedAt(i, *memory);
    });
    if (run.ShouldStop()) return;
    LeaveToOneSeedEach(&seeds);
    std::vector<Carving> best(faces_.size());
    std::vector<int64_t> part_count(faces_.size(), 0);
    oneapi::tbb::parallel_for(size_t{0}, faces_.size(), [&](size_t i) {
      if (run.ShouldStop()) return;
      PartSearch search(mesh_, hull_, limits);
      for (const std::vector<int>& part : seeds[i].parts) search.Run(faces_, part);
      best[i] = search.best();
      part_count[i] = search.part_count();
    });
    for (size_t i = 0; i < faces_.size(); ++i) {
      memory->part_count += part_count[i];
      if (best[i].cost_per_face <= limits.max_cost_per_face) {
        found->push_back(std::move(best[i]));
      } else {
        memory->digests[halves_[i]] = seeds[i].digest;
      }
    }
  }

 private:
  // A face, with the parts around it that are to be searched.
  struct Seed {
    std::vector<std::vector<int>> parts;  // indices of faces, smallest first
    uint64_t digest = 0;                  // of the largest
  };

  // Without parts where they are known to hold nothing.
  Seed SeedAt(size_t face, const CarveMemory& memory) const {
    Seed seed;
    for (const double radius : kRadii) {
      auto part = PartAround(faces_, centres_, neighbours_, static_cast<int>(face), radius);
      if (seed.parts.empty() || part.size() > seed.parts.back().size()) {
        seed.parts.push_back(std::move(part));
      }
    }
    seed.digest = DigestOf(seed.parts.back());
    const auto known = memory.digests.find(halves_[face]);
    if (known != memory.digests.end() && known->second == seed.digest) seed.parts.clear();
    return seed;
  }

  // A quarter of the parts is around several seeds.
  static void LeaveToOneSeedEach(std::vector<Seed>* seeds) {
    std::set<std::vector<int>> taken;
    for (Seed& seed : *seeds) {
      std::erase_if(seed.parts, [&](const auto& part) { return !taken.insert(part).second; });
    }
  }

  // FNV-1a over the part's half-faces.
  uint64_t DigestOf(const std::vector<int>& part) const {
    uint64_t digest = 0xcbf29ce484222325u;
    for (const int i : part) digest = (digest ^ static_cast<uint64_t>(halves_[i])) * 0x100000001b3u;
    return digest;
  }

  const std::vector<CellFace>& faces_;
  const Hull& hull_;
  const WorkingMesh& mesh_;
  const std::vector<std::vector<int>> neighbours_;
  std::vector<Vec3d> centres_;
  std::vector<int> halves_;
};

}  // namespace

int CarveCavities(const Hull& hull, const CarveLimits& limits, const RunContext& run,
                  CarveMemory* memory, WorkingMesh* mesh) {
  if (memory->part_count >= memory->most_parts) return 0;
  const Cavities cavities = CollectCavities(*mesh);
  std::vector<Carving> found;
  for (const auto& faces : cavities.faces) {
    CavityCarver(faces, hull, *mesh).Search(limits, run, memory, &found);
  }
  if (run.ShouldStop()) return 0;
  std::stable_sort(found.begin(), found.end(), [](const Carving& a, const Carving& b) {
    return a.cost_per_face < b.cost_per_face;
  });
  int applied = 0;
  for (const Carving& carving : found) {
    if (!IsStillPossible(*mesh, carving)) continue;
    Apply(carving, mesh);
    ++applied;
  }
  return applied;
}

}  // namespace amhex
