// Which vertices a step has looked at, so that what it found holds until one of them moves.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "optimize/hull_deviation.h"
#include "optimize/placement.h"

namespace amhex {

class SeenVertices {
 public:
  // All three must outlive this; `list` gets each vertex once.
  SeenVertices(const Placement& placement, const HullSampling& sampling, std::vector<int32_t>& list)
      : placement_(placement),
        sampling_(sampling),
        list_(list),
        seen_in_(placement.complex.vertices.size(), 0) {}

  // For the next step.
  void StartAnew() {
    list_.clear();
    ++step_;
  }
  void Add(int32_t v) {
    if (std::exchange(seen_in_[v], step_) != step_) list_.push_back(v);
  }
  // Corners of the cells.
  template <class Cells>
  void AddCells(const Cells& cells) {
    for (const int32_t c : cells) {
      for (const int32_t v : placement_.complex.cells[c]) Add(v);
    }
  }
  // Corners of the faces of the boundary that the sampling's index visits there.
  void AddFacesNear(const Vec3d& place, double radius) {
    sampling_.face_index().VisitNear(place, radius, [&](int32_t f) {
      const CellFace& face = placement_.complex.hull_faces[f];
      for (int j = 0; j < face.count; ++j) Add(face.v[j]);
    });
  }

 private:
  const Placement& placement_;
  const HullSampling& sampling_;
  std::vector<int32_t>& list_;
  std::vector<int64_t> seen_in_;  // [vertex] the last step that has seen it
  int64_t step_ = 0;
};

}  // namespace amhex
