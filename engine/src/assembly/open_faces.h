// Which primitives form the mesh under assembly, and which of their half-faces are open.
//
// The paper keeps the open faces as a set and adds a primitive by symmetric difference: a face
// that was open closes, one that was not opens. Here every half-face knows its owner, which says
// the same and also from which side it is open.
#pragma once

#include <cstdint>
#include <vector>

#include "topology/primitive_table.h"

namespace amhex {

inline constexpr int32_t kNoPrimitive = -1;

class OpenFaces {
 public:
  // The empty mesh. `table` must outlive this.
  explicit OpenFaces(const PrimitiveTable& table);

  // The primitive of the mesh that uses the half-face, or kNoPrimitive.
  int32_t owner(HalfFaceId half_face) const { return owner_[half_face]; }

  bool IsInMesh(int32_t primitive) const { return in_mesh_[primitive] != 0; }

  // Used by one primitive, no other lies against it and it is not part of the hull.
  bool IsOpen(HalfFaceId half_face) const {
    return owner_[half_face] != kNoPrimitive && owner_[OppositeOf(half_face)] == kNoPrimitive &&
           table_.on_hull[half_face] == 0;
  }

  // True if no half-face of the primitive is used yet.
  bool CanAdd(const Primitive& primitive) const;

  // True if the primitive lies on the far side of a hull face of the mesh.
  bool IsBehindHull(const Primitive& primitive) const;

  // How many open faces adding the primitive would close, and how many it would open.
  struct Change {
    int closed = 0;
    int opened = 0;
  };
  Change ChangeBy(const Primitive& primitive) const;

  // REQUIRES: CanAdd.
  void Add(int32_t primitive);
  void Remove(int32_t primitive);

  // Ascending.
  std::vector<int32_t> PrimitivesWithOpenFaces() const;
  int64_t CountOpen() const;

 private:
  const PrimitiveTable& table_;
  std::vector<int32_t> owner_;    // [half_face_count]
  std::vector<uint8_t> in_mesh_;  // [primitive_count]
};

}  // namespace amhex
