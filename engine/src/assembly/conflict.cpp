#include "assembly/conflict.h"

#include <algorithm>
#include <cmath>

#include "assembly/overlap.h"
#include "topology/primitives.h"

namespace amhex {
namespace {

constexpr double kBinSize = 1.5;  // edge lengths; a cell lies in one to eight bins

int64_t BinOf(double coordinate) { return static_cast<int64_t>(std::floor(coordinate / kBinSize)); }

// 21 bits per axis; far more bins than a normalised frame can have.
uint64_t BinKey(int64_t x, int64_t y, int64_t z) {
  constexpr uint64_t kMask = (uint64_t{1} << 21) - 1;
  return (static_cast<uint64_t>(x) & kMask) << 42 | (static_cast<uint64_t>(y) & kMask) << 21 |
         (static_cast<uint64_t>(z) & kMask);
}

bool ShareFace(const Primitive& a, const Primitive& b) {
  for (int i = 0; i < a.face_count; ++i) {
    for (int j = 0; j < b.face_count; ++j) {
      if (a.half_faces[i] == OppositeOf(b.half_faces[j])) return true;
    }
  }
  return false;
}

}  // namespace

template <class Visit>
void ConflictFinder::ForEachBin(int32_t primitive, const Visit& visit) const {
  const Box3d box = CellExtent(table_.primitives[primitive].corners, vertices_).box;
  for (int64_t x = BinOf(box.low.x); x <= BinOf(box.high.x); ++x) {
    for (int64_t y = BinOf(box.low.y); y <= BinOf(box.high.y); ++y) {
      for (int64_t z = BinOf(box.low.z); z <= BinOf(box.high.z); ++z) visit(BinKey(x, y, z));
    }
  }
}

ConflictFinder::ConflictFinder(const PrimitiveTable& table, const std::vector<Vec3d>& vertices,
                               const std::vector<int32_t>& asked)
    : table_(table), vertices_(vertices) {
  for (const int32_t primitive : asked) {
    ForEachBin(primitive, [&](uint64_t key) { bins_.try_emplace(key); });
  }
}

void ConflictFinder::Add(int32_t primitive) {
  ForEachBin(primitive, [&](uint64_t key) {
    if (const auto bin = bins_.find(key); bin != bins_.end()) bin->second.push_back(primitive);
  });
}

void ConflictFinder::Remove(int32_t primitive) {
  ForEachBin(primitive, [&](uint64_t key) {
    if (const auto bin = bins_.find(key); bin != bins_.end()) std::erase(bin->second, primitive);
  });
}

std::vector<int32_t> ConflictFinder::ConflictsOf(int32_t primitive) const {
  std::vector<int32_t> near;
  ForEachBin(primitive, [&](uint64_t key) {
    if (const auto bin = bins_.find(key); bin != bins_.end()) {
      near.insert(near.end(), bin->second.begin(), bin->second.end());
    }
  });
  std::sort(near.begin(), near.end());
  near.erase(std::unique(near.begin(), near.end()), near.end());
  const Primitive& asked = table_.primitives[primitive];
  const CellBody body(asked.corners, vertices_);
  std::vector<int32_t> conflicts;
  for (const int32_t other : near) {
    const Primitive& candidate = table_.primitives[other];
    if (other == primitive) continue;
    if (!MayOverlap(body.extent(), CellExtent(candidate.corners, vertices_))) continue;
    if (ShareFace(asked, candidate)) continue;
    if (Overlap(body, CellBody(candidate.corners, vertices_))) conflicts.push_back(other);
  }
  return conflicts;
}

}  // namespace amhex
