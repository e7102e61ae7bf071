#include "closure/carve.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <set>
#include <vector>

#include "base/sort_unique.h"
#include "closure/cavities.h"
#include "closure/cavity_parts.h"
#include "closure/part_search.h"
#include "closure/star_fill.h"

namespace amhex {
namespace {

// Parts of a network: open faces whose centres are this near to a seed's, in edge lengths.
constexpr double kRadii[] = {0.85, 1.3, 2.0};

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
    if (behind >= 0 && !IsAmong(carving.cells, behind)) return false;
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
