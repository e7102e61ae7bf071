#include "assembly/open_faces.h"

namespace amhex {

bool OpenFaces::CanAdd(const Primitive& primitive) const {
  for (int i = 0; i < primitive.face_count; ++i) {
    if (owner_[primitive.half_faces[i]] != kNoPrimitive) return false;
  }
  return true;
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
}

void OpenFaces::Remove(int32_t primitive) {
  const Primitive& removed = table_.primitives[primitive];
  for (int i = 0; i < removed.face_count; ++i) {
    if (owner_[removed.half_faces[i]] == primitive) owner_[removed.half_faces[i]] = kNoPrimitive;
  }
}

int64_t OpenFaces::CountOpen() const {
  int64_t count = 0;
  for (HalfFaceId h = 0; h < table_.faces.half_face_count(); ++h) count += IsOpen(h) ? 1 : 0;
  return count;
}

}  // namespace amhex
