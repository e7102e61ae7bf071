// primInConflict of listing 3: partial overlaps and inclusions. Section 5.2, III.
//
// Half-face conflicts (the same side of a face used twice) are OpenFaces' business; this finds
// primitives whose interiors overlap although they share no face.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "amhex/vec3.h"
#include "topology/primitive_table.h"

namespace amhex {

// The mesh under assembly, kept only around the primitives it may be asked about.
class ConflictFinder {
 public:
  // Primitives overlapping none of the bins that the primitives `asked` occupy are ignored by
  // Add and Remove, so that a large regular mesh costs little. Both references must outlive this.
  ConflictFinder(const PrimitiveTable& table, const std::vector<Vec3d>& vertices,
                 const std::vector<int32_t>& asked);

  void Add(int32_t primitive);
  void Remove(int32_t primitive);

  // The primitives of the mesh that overlap `primitive` (itself excepted), ascending. Safe from
  // several threads at a time.
  std::vector<int32_t> ConflictsOf(int32_t primitive) const;
  bool IsInConflict(int32_t primitive) const { return !ConflictsOf(primitive).empty(); }

 private:
  using Bins = std::unordered_map<uint64_t, std::vector<int32_t>>;

  template <class Visit>
  void ForEachBin(int32_t primitive, const Visit& visit) const;

  const PrimitiveTable& table_;
  const std::vector<Vec3d>& vertices_;
  Bins bins_;  // only ever looked up, never iterated
};

}  // namespace amhex
