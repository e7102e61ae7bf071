// Faces and the edges that join them: what the primitive search walks on.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "topology/edge_network.h"
#include "topology/face_complex_view.h"
#include "topology/half_face.h"

namespace amhex {

// Immutable. Faces keep the order they are given in.
class FaceComplex {
 public:
  // Every face once, no vertex twice in a face, ids in [0, vertex_count). Linear time.
  static FaceComplex Build(int32_t vertex_count, std::vector<CellFace> faces);

  // For as long as this.
  FaceComplexView view() const {
    return {{faces_.data(), static_cast<int64_t>(faces_.size())},
            {edges_of_face_.data(), static_cast<int64_t>(edges_of_face_.size())},
            {first_.data(), static_cast<int64_t>(first_.size())},
            {faces_of_edge_.data(), static_cast<int64_t>(faces_of_edge_.size())}};
  }

  int32_t face_count() const { return static_cast<int32_t>(faces_.size()); }
  int32_t edge_count() const { return edge_count_; }
  const CellFace& face(int32_t index) const { return faces_[index]; }

  // In ring order: edge i joins corners i and i + 1. A triangle's fourth entry is kNoEdge.
  const std::array<int32_t, 4>& edges_of(int32_t face) const { return edges_of_face_[face]; }

  // Ascending.
  std::span<const int32_t> faces_at(int32_t edge) const {
    return {faces_of_edge_.data() + first_[edge], faces_of_edge_.data() + first_[edge + 1]};
  }

 private:
  std::vector<CellFace> faces_;
  std::vector<std::array<int32_t, 4>> edges_of_face_;
  std::vector<int32_t> first_;  // [edge_count + 1] rows of faces_of_edge_
  std::vector<int32_t> faces_of_edge_;
  int32_t edge_count_ = 0;
};

}  // namespace amhex
