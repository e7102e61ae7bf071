#include "closure/tetrahedral_cover.h"

#include <algorithm>

namespace amhex {
namespace {

bool Has(const CellFace& face, int32_t v) {
  for (int j = 0; j < face.count; ++j) {
    if (face.v[j] == v) return true;
  }
  return false;
}

// The face of a cell that has all three vertices; -1 if there is none.
int FaceWith(const CellFaces& faces, int32_t a, int32_t b, int32_t c) {
  for (int f = 0; f < faces.count; ++f) {
    if (Has(faces.face[f], a) && Has(faces.face[f], b) && Has(faces.face[f], c)) return f;
  }
  return -1;
}

bool LiesOnOneFace(const CellFaces& faces, const std::array<int32_t, 4>& v) {
  const int f = FaceWith(faces, v[0], v[1], v[2]);
  return f >= 0 && Has(faces.face[f], v[3]);
}

std::array<int32_t, 3> FaceOpposite(const std::array<int32_t, 4>& v, int corner) {
  std::array<int32_t, 3> face{};
  for (int k = 0, n = 0; k < 4; ++k) {
    if (k != corner) face[n++] = v[k];
  }
  return face;
}

}  // namespace

TetrahedralCover::TetrahedralCover(const WorkingMesh& mesh, const FillScope& scope,
                                   const std::vector<int>& extra_vertices, uint64_t seed)
    : mesh_(mesh), scope_(scope) {
  std::vector<uint8_t> used(mesh.vertices().size(), 0);
  for (const int cell : scope.cells) {
    for (const int32_t v : VerticesOf(mesh.corners(cell))) used[v] = 1;
  }
  for (const int v : extra_vertices) used[v] = 1;
  std::vector<int32_t> vertex_of_point;
  std::vector<Vec3d> points;
  for (size_t v = 0; v < used.size(); ++v) {
    if (!used[v]) continue;
    vertex_of_point.push_back(static_cast<int32_t>(v));
    points.push_back(scope.ToMetric(mesh.vertices()[v]));
  }
  tetrahedra_ = DelaunayTetrahedralization(points, seed);
  for (auto& corners : tetrahedra_.vertices) {
    for (int32_t& v : corners) {
      if (v >= 0) v = vertex_of_point[v];
    }
  }
  incident_begin_.assign(used.size() + 1, 0);
  for (const auto& corners : tetrahedra_.vertices) {
    for (const int32_t v : corners) {
      if (v >= 0) ++incident_begin_[v + 1];
    }
  }
  for (size_t v = 0; v < used.size(); ++v) incident_begin_[v + 1] += incident_begin_[v];
  incident_.resize(incident_begin_.back());
  std::vector<int> fill(incident_begin_.begin(), incident_begin_.end() - 1);
  for (int t = 0; t < tetrahedra_.count(); ++t) {
    for (const int32_t v : tetrahedra_.vertices[t]) {
      if (v >= 0) incident_[fill[v]++] = t;
    }
  }
}

std::vector<int> TetrahedralCover::TetrahedraWithin(const CellVertices& vertices) const {
  std::vector<int> result;
  const auto within = [&](int32_t v) {
    return std::find(vertices.begin(), vertices.end(), v) != vertices.end();
  };
  for (const int32_t v : vertices) {
    for (int k = incident_begin_[v]; k < incident_begin_[v + 1]; ++k) {
      const auto& corners = tetrahedra_.vertices[incident_[k]];
      // Each tetrahedron is taken at its smallest vertex.
      if (*std::min_element(corners.begin(), corners.end()) != v) continue;
      if (std::all_of(corners.begin(), corners.end(), within)) result.push_back(incident_[k]);
    }
  }
  return result;
}

bool TetrahedralCover::FindUnion(int cell, std::vector<int>* solid, std::vector<int>* flat) const {
  const CellFaces faces = FacesOf(mesh_.corners(cell));
  solid->clear();
  flat->clear();
  for (const int t : TetrahedraWithin(VerticesOf(mesh_.corners(cell)))) {
    (LiesOnOneFace(faces, tetrahedra_.vertices[t]) ? flat : solid)->push_back(t);
  }
  std::array<int, 6> triangles{};
  for (const int t : *solid) {
    for (int i = 0; i < 4; ++i) {
      const int n = tetrahedra_.neighbours[t][i];
      if (std::find(solid->begin(), solid->end(), n) != solid->end()) continue;
      const auto [a, b, c] = FaceOpposite(tetrahedra_.vertices[t], i);
      const int f = FaceWith(faces, a, b, c);
      if (f < 0) return false;
      ++triangles[f];
    }
  }
  for (int f = 0; f < faces.count; ++f) {
    if (triangles[f] != faces.face[f].count - 2) return false;
  }
  return true;
}

void TetrahedralCover::CoverCells(const std::vector<uint8_t>& excluded) {
  const int count = tetrahedra_.count();
  occupant_.assign(count, kFree);
  flat_cell_.assign(count, -1);
  covered_.assign(mesh_.cell_slots(), 0);
  for (int t = 0; t < count; ++t) {
    if (!tetrahedra_.IsFinite(t)) occupant_[t] = kOutside;
  }
  std::vector<int> solid, flat;
  for (const int cell : scope_.cells) {
    if (excluded[cell] || !FindUnion(cell, &solid, &flat)) continue;
    const bool taken =
        std::any_of(solid.begin(), solid.end(), [&](int t) { return occupant_[t] != kFree; });
    if (taken) continue;
    covered_[cell] = 1;
    for (const int t : solid) occupant_[t] = cell;
  }
  for (const int cell : scope_.cells) {
    if (!covered_[cell]) continue;
    FindUnion(cell, &solid, &flat);
    for (const int t : flat) {
      if (occupant_[t] != kFree) continue;
      // Only a flat one that touches the cell's own tetrahedra is the other diagonal of its quad.
      const auto& n = tetrahedra_.neighbours[t];
      if (std::any_of(n.begin(), n.end(), [&](int m) { return occupant_[m] == cell; })) {
        occupant_[t] = kVanished;
        flat_cell_[t] = cell;
      }
    }
  }
}

TetrahedralCover::Neighbour TetrahedralCover::Across(int t, int i) const {
  const int n = tetrahedra_.neighbours[t][i];
  Neighbour result;
  int cell = occupant_[n];
  if (cell == kVanished) cell = flat_cell_[n];
  if (cell < 0) {
    result.tetrahedron = n;
    return result;
  }
  const auto [a, b, c] = FaceOpposite(tetrahedra_.vertices[t], i);
  const CellFaces faces = FacesOf(mesh_.corners(cell));
  const int f = FaceWith(faces, a, b, c);
  result.cell = cell;
  if (f >= 0) result.face = faces.face[f];
  return result;
}

std::vector<int> TetrahedralCover::TetrahedraBehind(int cell, const CellFace& face) const {
  std::vector<int> result;
  const auto add_free = [&](int t) {
    if (occupant_[t] == kFree && std::find(result.begin(), result.end(), t) == result.end()) {
      result.push_back(t);
    }
  };
  const auto on_face = [&](const std::array<int32_t, 3>& triangle) {
    return Has(face, triangle[0]) && Has(face, triangle[1]) && Has(face, triangle[2]);
  };
  for (const int t : TetrahedraWithin(VerticesOf(mesh_.corners(cell)))) {
    if (occupant_[t] != cell) continue;
    for (int i = 0; i < 4; ++i) {
      if (!on_face(FaceOpposite(tetrahedra_.vertices[t], i))) continue;
      const int n = tetrahedra_.neighbours[t][i];
      if (occupant_[n] != kVanished) {
        add_free(n);
        continue;
      }
      for (const int beyond : tetrahedra_.neighbours[n]) add_free(beyond);
    }
  }
  return result;
}

int TetrahedralCover::Containing(const Vec3d& p, int32_t near_vertex) const {
  if (incident_begin_[near_vertex] == incident_begin_[near_vertex + 1]) return -1;
  int t = incident_[incident_begin_[near_vertex]];
  constexpr int kMaxSteps = 1000;  // a walk across a cell takes a handful
  const auto& x = mesh_.vertices();
  for (int step = 0; step < kMaxSteps; ++step) {
    const auto& v = tetrahedra_.vertices[t];
    int next = -1;
    for (int k = 0; k < 4 && next < 0; ++k) {
      const int i = (step + k) % 4;
      if (!tetrahedra_.IsFinite(t)) {
        if (v[i] == Tetrahedra::kInfinite) next = tetrahedra_.neighbours[t][i];
        continue;
      }
      // Replace corner i by p: negative means p lies beyond the opposite face.
      std::array<Vec3d, 4> c;
      for (int m = 0; m < 4; ++m) c[m] = m == i ? p : x[v[m]];
      if (Determinant(c[1] - c[0], c[2] - c[0], c[3] - c[0]) < -1e-14) {
        next = tetrahedra_.neighbours[t][i];
      }
    }
    if (next < 0) return t;
    if (!tetrahedra_.IsFinite(next) && tetrahedra_.IsFinite(t)) return next;
    t = next;
  }
  return -1;
}

}  // namespace amhex
