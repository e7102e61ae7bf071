#include "topology/face_complex.h"

#include <utility>

namespace amhex {

FaceComplex FaceComplex::Build(int32_t vertex_count, std::vector<CellFace> faces) {
  std::vector<VertexPair> sides;
  sides.reserve(4 * faces.size());
  for (const CellFace& face : faces) {
    for (int i = 0; i < face.count; ++i) {
      sides.push_back({face.v[i], face.v[(i + 1) % face.count]});
    }
  }
  const EdgeNetwork network = EdgeNetwork::Build(vertex_count, sides);
  FaceComplex complex;
  complex.faces_ = std::move(faces);
  complex.edge_count_ = network.edge_count();
  complex.edges_of_face_.reserve(complex.faces_.size());
  complex.first_.assign(static_cast<size_t>(network.edge_count()) + 1, 0);
  for (const CellFace& face : complex.faces_) {
    std::array<int32_t, 4> edges{kNoEdge, kNoEdge, kNoEdge, kNoEdge};
    for (int i = 0; i < face.count; ++i) {
      edges[i] = network.FindEdge(face.v[i], face.v[(i + 1) % face.count]);
      ++complex.first_[edges[i] + 1];
    }
    complex.edges_of_face_.push_back(edges);
  }
  for (int32_t e = 0; e < network.edge_count(); ++e) complex.first_[e + 1] += complex.first_[e];
  std::vector<int32_t> next(complex.first_.begin(), complex.first_.end() - 1);
  complex.faces_of_edge_.resize(sides.size());
  for (int32_t f = 0; f < complex.face_count(); ++f) {
    for (int i = 0; i < complex.faces_[f].count; ++i) {
      complex.faces_of_edge_[next[complex.edges_of_face_[f][i]]++] = f;
    }
  }
  return complex;
}

}  // namespace amhex
