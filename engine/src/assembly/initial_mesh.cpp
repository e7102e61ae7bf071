#include "assembly/initial_mesh.h"

#include <algorithm>
#include <tuple>

#include "topology/parallel_blocks.h"

namespace amhex {
namespace {

constexpr int64_t kPrimitivesPerBlock = 256;

// Initial primitives that share a half-face with another one.
std::vector<int32_t> FindContested(const PrimitiveTable& table) {
  std::vector<uint8_t> claims(static_cast<size_t>(table.faces.half_face_count()), 0);
  for (int32_t i = 0; i < table.initial_count; ++i) {
    const Primitive& primitive = table.primitives[i];
    for (int j = 0; j < primitive.face_count; ++j) {
      uint8_t& claim = claims[primitive.half_faces[j]];
      claim = static_cast<uint8_t>(claim < 2 ? claim + 1 : 2);
    }
  }
  std::vector<int32_t> contested;
  for (int32_t i = 0; i < table.initial_count; ++i) {
    const Primitive& primitive = table.primitives[i];
    const auto begin = primitive.half_faces.begin();
    const auto is_contested = [&](HalfFaceId h) { return claims[h] > 1; };
    if (std::any_of(begin, begin + primitive.face_count, is_contested)) contested.push_back(i);
  }
  return contested;
}

void SortByPriority(const PrimitiveTable& table, std::vector<int32_t>* primitives) {
  std::sort(primitives->begin(), primitives->end(),
            [&](int32_t a, int32_t b) { return HasPriority(table, a, b); });
}

}  // namespace

bool HasPriority(const PrimitiveTable& table, int32_t a, int32_t b) {
  const Primitive &p = table.primitives[a], &q = table.primitives[b];
  return std::make_tuple(q.type, q.quality, a) < std::make_tuple(p.type, p.quality, b);
}

void AddWithoutSharedHalfFaces(const PrimitiveTable& table, OpenFaces* open_faces) {
  std::vector<int32_t> contested = FindContested(table);
  auto next = contested.begin();
  for (int32_t i = 0; i < table.initial_count; ++i) {
    if (next != contested.end() && *next == i) {
      ++next;
    } else {
      open_faces->Add(i);
    }
  }
  SortByPriority(table, &contested);
  for (const int32_t i : contested) {
    if (open_faces->CanAdd(table.primitives[i])) open_faces->Add(i);
  }
}

absl::Status RemoveOverlaps(const PrimitiveTable& table, const RunContext& context,
                            OpenFaces* open_faces, ConflictFinder* conflicts) {
  const std::vector<int32_t> asked = open_faces->PrimitivesWithOpenFaces();
  std::vector<int32_t> in_conflict;
  absl::Status status =
      CollectFromBlocks(static_cast<int64_t>(asked.size()), kPrimitivesPerBlock, context,
                        &in_conflict, [&](int64_t begin, int64_t end, std::vector<int32_t>* found) {
                          for (int64_t i = begin; i < end; ++i) {
                            const std::vector<int32_t> others = conflicts->ConflictsOf(asked[i]);
                            found->insert(found->end(), others.begin(), others.end());
                            if (!others.empty()) found->push_back(asked[i]);
                          }
                        });
  if (!status.ok()) return status;
  SortByPriority(table, &in_conflict);
  in_conflict.erase(std::unique(in_conflict.begin(), in_conflict.end()), in_conflict.end());
  for (const int32_t i : in_conflict) {
    open_faces->Remove(i);
    conflicts->Remove(i);
  }
  for (const int32_t i : in_conflict) {
    if (conflicts->IsInConflict(i)) continue;
    open_faces->Add(i);
    conflicts->Add(i);
  }
  return absl::OkStatus();
}

}  // namespace amhex
