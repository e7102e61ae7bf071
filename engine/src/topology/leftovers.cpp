#include "topology/leftovers.h"

#include <algorithm>

namespace amhex {

Leftovers::Leftovers(const MergedCubes& cubes, const PrimitiveTable& initial)
    : initial_(initial), claims_(static_cast<size_t>(initial.faces.half_face_count()), 0) {
  std::vector<uint8_t> is_initial(cubes.corners.size(), 0);
  for (const Primitive& primitive : initial.primitives) {
    is_initial[primitive.cube] = 1;
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
    if (is_initial[i] == 0) include(cubes.corners[i].data(), 8);
  }
  for (int32_t f = 0; f < initial.faces.count(); ++f) {
    if (!IsSettledFace(f)) include(initial.faces.face(f).v.data(), initial.faces.face(f).count);
  }
}

bool Leftovers::IsSettledFace(int32_t face) const {
  const HalfFaceId front = 2 * face, back = front + 1;
  if (claims_[front] > 1 || claims_[back] > 1) return false;
  if (IsUsed(front) && IsUsed(back)) return true;
  return (IsUsed(front) && initial_.on_hull[front] != 0) ||
         (IsUsed(back) && initial_.on_hull[back] != 0);
}

std::vector<CellFace> Leftovers::UnsettledFaces() const {
  std::vector<CellFace> faces;
  for (int32_t f = 0; f < initial_.faces.count(); ++f) {
    if (!IsSettledFace(f)) faces.push_back(initial_.faces.face(f));
  }
  return faces;
}

bool Leftovers::IsSettled(const CellFace& face) const {
  const HalfFaceId id = initial_.faces.Find(face);
  return id != kNoHalfFace && IsSettledFace(FaceOf(id));
}

bool Leftovers::Fits(const CellCorners& corners) const {
  for (const CellFace& face : FacesOf(corners)) {
    const HalfFaceId id = initial_.faces.Find(face);
    if (id == kNoHalfFace) continue;
    const HalfFaceId behind = OppositeOf(id);
    if (claims_[id] == 1 || (IsUsed(behind) && initial_.on_hull[behind] != 0)) return false;
  }
  return true;
}

}  // namespace amhex
