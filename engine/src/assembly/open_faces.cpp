#include "assembly/open_faces.h"

#include <algorithm>

namespace amhex {

OpenFaces::OpenFaces(const PrimitiveTable& table)
    : table_(table),
      owner_(static_cast<size_t>(table.faces.half_face_count()), kNoPrimitive),
      in_mesh_(table.primitives.size(), 0) {}

bool OpenFaces::CanAdd(const Primitive& primitive) const {
  for (int i = 0; i < primitive.face_count; ++i) {
    if (owner_[primitive.half_faces[i]] != kNoPrimitive) return false;
  }
  return true;
}

bool OpenFaces::IsBehindHull(const Primitive& primitive) const {
  for (int i = 0; i < primitive.face_count; ++i) {
    const HalfFaceId behind = OppositeOf(primitive.half_faces[i]);
    if (owner_[behind] != kNoPrimitive && table_.on_hull[behind] != 0) return true;
  }
  return false;
}

OpenFaces::Change OpenFaces::ChangeBy(const Primitive& primitive) const {
  Change change;
  for (int i = 0; i < primitive.face_count; ++i) {
    const HalfFaceId half_face = primitive.half_faces[i];
    if (IsOpen(OppositeOf(half_face))) {
      ++change.closed;
    } else if (owner_[OppositeOf(half_face)] == kNoPrimitive && table_.on_hull[half_face] == 0) {
      ++change.opened;
    }
  }
  return change;
}

void OpenFaces::Add(int32_t primitive) {
  const Primitive& added = table_.primitives[primitive];
  for (int i = 0; i < added.face_count; ++i) owner_[added.half_faces[i]] = primitive;
  in_mesh_[primitive] = 1;
}

void OpenFaces::Remove(int32_t primitive) {
  const Primitive& removed = table_.primitives[primitive];
  for (int i = 0; i < removed.face_count; ++i) owner_[removed.half_faces[i]] = kNoPrimitive;
  in_mesh_[primitive] = 0;
}

std::vector<int32_t> OpenFaces::PrimitivesWithOpenFaces() const {
  std::vector<int32_t> primitives;
  for (size_t i = 0; i < in_mesh_.size(); ++i) {
    const Primitive& primitive = table_.primitives[i];
    const auto begin = primitive.half_faces.begin();
    if (in_mesh_[i] != 0 &&
        std::any_of(begin, begin + primitive.face_count, [&](HalfFaceId h) { return IsOpen(h); })) {
      primitives.push_back(static_cast<int32_t>(i));
    }
  }
  return primitives;
}

int64_t OpenFaces::CountOpen() const {
  int64_t count = 0;
  for (HalfFaceId h = 0; h < table_.faces.half_face_count(); ++h) count += IsOpen(h) ? 1 : 0;
  return count;
}

}  // namespace amhex
