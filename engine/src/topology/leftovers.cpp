#include "topology/leftovers.h"

#include <algorithm>

namespace amhex {

Leftovers::Leftovers(const MergedCubes& cubes, const PrimitiveTable& direct)
    : direct_(direct), claims_(static_cast<size_t>(direct.faces.half_face_count()), 0) {
  std::vector<uint8_t> is_direct(cubes.corners.size(), 0);
  for (const Primitive& primitive : direct.primitives) {
    is_direct[primitive.cube] = 1;
    for (int i = 0; i < primitive.face_count; ++i) {
      uint8_t& claim = claims_[primitive.half_faces[i]];
      claim = static_cast<uint8_t>(std::min(claim + 1, 2));
    }
  }
  const auto include = [&](const int32_t* vertices, int count) {
    region_.resize(cubes.vertices.size(), 0);
    for (int i = 0; i < count; ++i) region_[vertices[i]] = 1;
  };
  for (size_t i = 0; i < cubes.corners.size(); ++i) {
    if (is_direct[i] == 0) include(cubes.corners[i].data(), 8);
  }
  for (int32_t f = 0; f < direct.faces.count(); ++f) {
    if (!IsSettledFace(f)) include(direct.faces.face(f).v.data(), direct.faces.face(f).count);
  }
}

bool Leftovers::IsSettledFace(int32_t face) const {
  const HalfFaceId front = 2 * face, back = front + 1;
  if (claims_[front] > 1 || claims_[back] > 1) return false;
  if (IsUsed(front) && IsUsed(back)) return true;
  return (IsUsed(front) && direct_.on_hull[front] != 0) ||
         (IsUsed(back) && direct_.on_hull[back] != 0);
}

std::vector<CellFace> Leftovers::UnsettledFaces() const {
  std::vector<CellFace> faces;
  for (int32_t f = 0; f < direct_.faces.count(); ++f) {
    if (!IsSettledFace(f)) faces.push_back(direct_.faces.face(f));
  }
  return faces;
}

bool Leftovers::IsSettled(const CellFace& face) const {
  const HalfFaceId id = direct_.faces.Find(face);
  return id != kNoHalfFace && IsSettledFace(FaceOf(id));
}

bool Leftovers::Fits(const CellCorners& corners, int min_closed) const {
  int closed = 0;
  for (const CellFace& face : FacesOf(corners)) {
    const HalfFaceId id = direct_.faces.Find(face);
    if (id == kNoHalfFace) continue;
    const HalfFaceId behind = OppositeOf(id);
    if (claims_[id] == 1) return false;
    if (!IsUsed(behind)) continue;
    if (direct_.on_hull[behind] != 0) return false;
    ++closed;
  }
  return closed >= min_closed;
}

}  // namespace amhex
