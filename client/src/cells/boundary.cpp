#include "cells/boundary.h"

#include <algorithm>
#include <array>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"

namespace amhex::client {
namespace {

using FaceKey = std::array<int32_t, 4>;  // sorted; triangles begin with -1

FaceKey KeyOf(const Face& face) {
  FaceKey key = face.vertex;
  std::sort(key.begin(), key.end());
  return key;
}

// True if both faces pass through the same vertices in opposite directions.
bool AreOpposite(const Face& a, const Face& b) {
  if (a.count != b.count) return false;
  const auto start = std::find(b.vertex.begin(), b.vertex.begin() + b.count, a.vertex[0]);
  const int offset = static_cast<int>(start - b.vertex.begin());
  for (int i = 0; i < a.count; ++i) {
    if (a.vertex[i] != b.vertex[(offset + b.count - i) % b.count]) return false;
  }
  return true;
}

struct Use {
  BoundaryFace first;
  int count = 0;
};

}  // namespace

absl::StatusOr<std::vector<BoundaryFace>> BoundaryOf(const AtMostHexaMesh& mesh,
                                                     const std::vector<bool>& keep) {
  absl::flat_hash_map<FaceKey, Use> uses;
  uses.reserve(4 * mesh.corners.size());
  for (size_t cell = 0; cell < mesh.corners.size(); ++cell) {
    if (!keep.empty() && !keep[cell]) continue;
    for (const Face& face : FacesOfCell(mesh.corners[cell])) {
      Use& use = uses[KeyOf(face)];
      if (++use.count == 1) {
        use.first = {face, static_cast<int32_t>(cell)};
      } else if (use.count > 2 || !AreOpposite(use.first.face, face)) {
        return absl::DataLossError(absl::StrCat(
            "cells ", use.first.cell, " and ", cell,
            use.count > 2 ? " share a face with a third cell" : " overlap at a common face"));
      }
    }
  }
  std::vector<BoundaryFace> boundary;
  for (const auto& [key, use] : uses) {
    if (use.count == 1) boundary.push_back(use.first);
  }
  // The hash map's order is arbitrary; vertices decide between the faces of one cell.
  std::sort(boundary.begin(), boundary.end(), [](const BoundaryFace& a, const BoundaryFace& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.face.vertex < b.face.vertex;
  });
  return boundary;
}

}  // namespace amhex::client
