#include "closure/excerpt.h"

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "base/sort_unique.h"

namespace amhex {
namespace {

// The same however the face is turned.
std::array<int32_t, 4> SortedVertices(const CellFace& face) {
  std::array<int32_t, 4> vertices = face.v;
  if (face.count == 3) vertices[3] = -1;
  std::sort(vertices.begin(), vertices.end());
  return vertices;
}

}  // namespace

std::vector<int> WithRing(const WorkingMesh& mesh, const CellLists& cells_at,
                          const std::vector<int>& cells) {
  std::vector<int> grown;
  for (const int cell : cells) {
    for (const int32_t v : VerticesOf(mesh.corners(cell))) {
      grown.insert(grown.end(), cells_at[v].begin(), cells_at[v].end());
    }
  }
  std::sort(grown.begin(), grown.end());
  grown.erase(std::unique(grown.begin(), grown.end()), grown.end());
  return grown;
}

Excerpt::Excerpt(const WorkingMesh& whole, std::vector<int> cells) : cells_(std::move(cells)) {
  for (const int cell : cells_) {
    for (const int32_t v : VerticesOf(whole.corners(cell))) vertices_.push_back(v);
  }
  std::sort(vertices_.begin(), vertices_.end());
  vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());
  const auto own = [&](int32_t v) {
    return static_cast<int32_t>(std::lower_bound(vertices_.begin(), vertices_.end(), v) -
                                vertices_.begin());
  };
  is_at_cut_.assign(vertices_.size(), 0);
  for (const int32_t v : vertices_) complex_.vertices.push_back(whole.vertices()[v]);
  for (const int cell : cells_) {
    CellCorners corners = whole.corners(cell);
    for (int32_t& corner : corners) corner = own(corner);
    complex_.cells.push_back(corners);
    const CellFaces faces = FacesOf(corners);
    for (int i = 0; i < faces.count; ++i) {
      const int32_t behind = whole.owner(whole.half_faces(cell)[i] ^ 1);
      if (behind == WorkingMesh::kHull) complex_.hull_faces.push_back(faces.face[i]);
      if (behind < 0 || std::binary_search(cells_.begin(), cells_.end(), behind)) continue;
      cut_.push_back(faces.face[i]);
      for (int j = 0; j < faces.face[i].count; ++j) is_at_cut_[faces.face[i].v[j]] = 1;
    }
  }
}

CellComplex Excerpt::Closed() const {
  CellComplex closed = complex_;
  closed.hull_faces.insert(closed.hull_faces.end(), cut_.begin(), cut_.end());
  return closed;
}

int32_t Excerpt::CellOf(int cell_of_whole) const {
  return static_cast<int32_t>(std::lower_bound(cells_.begin(), cells_.end(), cell_of_whole) -
                              cells_.begin());
}

bool Excerpt::TakeBack(CellComplex* changed) const {
  const auto is_at_cut = [&](const CellCorners& corners) {
    return std::any_of(corners.begin(), corners.end(), [&](int32_t v) {
      return v < static_cast<int32_t>(is_at_cut_.size()) && is_at_cut_[v];
    });
  };
  const auto cells_at_cut = [&](const CellComplex& complex) {
    std::vector<std::vector<int32_t>> found;
    for (const CellCorners& corners : complex.cells) {
      if (!is_at_cut(corners)) continue;
      // However they are listed: of a cell with collapsed edges any corner may come twice.
      std::vector<int32_t> cell(corners.begin(), corners.end());
      SortUnique(cell);
      found.push_back(std::move(cell));
    }
    std::sort(found.begin(), found.end());
    return found;
  };
  if (cells_at_cut(*changed) != cells_at_cut(complex_)) return false;
  if (WorkingMesh(*changed).HasOpenFaces()) return false;
  std::set<std::array<int32_t, 4>> cut;
  for (const CellFace& face : cut_) cut.insert(SortedVertices(face));
  std::erase_if(changed->hull_faces,
                [&](const CellFace& face) { return cut.contains(SortedVertices(face)); });
  return true;
}

bool Excerpt::PutInto(const CellComplex& changed, WorkingMesh* whole) const {
  std::vector<int32_t> number = vertices_;  // in the whole
  for (size_t v = 0; v < changed.vertices.size(); ++v) {
    if (v < vertices_.size()) {
      whole->vertices()[number[v]] = changed.vertices[v];
    } else {
      number.push_back(whole->AddVertex(changed.vertices[v]));
    }
  }
  for (const int cell : cells_) whole->RemoveCell(cell);
  for (CellCorners corners : changed.cells) {
    for (int32_t& corner : corners) corner = number[corner];
    if (whole->AddCell(corners) < 0) return false;
  }
  for (CellFace face : changed.hull_faces) {
    for (int j = 0; j < face.count; ++j) face.v[j] = number[face.v[j]];
    whole->MarkHull(face);
  }
  return true;
}

}  // namespace amhex
