#include "assembly/initial_mesh.h"

#include <algorithm>
#include <tuple>

namespace amhex {
namespace {

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

}  // namespace

std::vector<uint8_t> ChooseInitialMesh(const PrimitiveTable& table, OpenFaces* open_faces) {
  std::vector<uint8_t> in_mesh(table.primitives.size(), 0);
  std::fill_n(in_mesh.begin(), table.initial_count, uint8_t{1});
  std::vector<int32_t> contested = FindContested(table);
  for (const int32_t i : contested) in_mesh[i] = 0;
  for (int32_t i = 0; i < table.initial_count; ++i) {
    if (in_mesh[i] != 0) open_faces->Add(i);
  }
  std::sort(contested.begin(), contested.end(), [&](int32_t a, int32_t b) {
    const Primitive &p = table.primitives[a], &q = table.primitives[b];
    return std::make_tuple(q.type, q.quality, a) < std::make_tuple(p.type, p.quality, b);
  });
  for (const int32_t i : contested) {
    if (!open_faces->CanAdd(table.primitives[i])) continue;
    open_faces->Add(i);
    in_mesh[i] = 1;
  }
  return in_mesh;
}

}  // namespace amhex
