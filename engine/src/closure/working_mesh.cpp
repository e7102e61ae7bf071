#include "closure/working_mesh.h"

#include <algorithm>

namespace amhex {

CellEdges EdgesOf(const CellCorners& corners) {
  CellEdges edges;
  for (const auto& [i, j] : kCubeEdges) {
    const std::array<int32_t, 2> edge = {std::min(corners[i], corners[j]),
                                         std::max(corners[i], corners[j])};
    if (edge[0] == edge[1] || std::find(edges.begin(), edges.end(), edge) != edges.end()) continue;
    edges.edge[edges.count++] = edge;
  }
  return edges;
}

CellFace Reversed(const CellFace& face) {
  CellFace reversed = face;
  std::reverse(reversed.v.begin(), reversed.v.begin() + face.count);
  return reversed;
}

Vec3d FaceCentroid(const CellFace& face, const std::vector<Vec3d>& vertices) {
  Vec3d sum;
  for (int j = 0; j < face.count; ++j) sum += vertices[face.v[j]];
  return sum / face.count;
}

Vec3d FaceUnitNormal(const CellFace& face, const std::vector<Vec3d>& vertices) {
  const Vec3d& a = vertices[face.v[0]];
  return Normalized(Cross(vertices[face.v[1]] - a, vertices[face.v[2]] - a));
}

WorkingMesh::WorkingMesh(const CellComplex& complex) : vertices_(complex.vertices) {
  cells_.reserve(complex.cells.size());
  for (const CellCorners& corners : complex.cells) AddCell(corners);
  for (const CellFace& face : complex.hull_faces) MarkHull(face);
}

CellComplex WorkingMesh::ToComplex() const {
  CellComplex complex;
  complex.vertices = vertices_;
  for (int cell = 0; cell < cell_slots(); ++cell) {
    if (!alive(cell)) continue;
    complex.cells.push_back(cells_[cell]);
    for (const CellFace& face : FacesOf(cells_[cell])) {
      if (Across(face) == kHull) complex.hull_faces.push_back(face);
    }
  }
  return complex;
}

WorkingMesh::FaceKey WorkingMesh::KeyOf(const CellFace& face, int* orientation) {
  int first = 0;
  for (int j = 1; j < face.count; ++j) {
    if (face.v[j] < face.v[first]) first = j;
  }
  const int32_t next = face.v[(first + 1) % face.count];
  const int32_t previous = face.v[(first + face.count - 1) % face.count];
  *orientation = next < previous ? 1 : 0;
  // The vertex opposite the smallest tells apart the rings that four vertices can form.
  const int32_t opposite = face.count == 4 ? face.v[(first + 2) % 4] : -1;
  return {face.v[first], std::min(next, previous), std::max(next, previous), opposite};
}

int WorkingMesh::HalfFace(const CellFace& face) {
  int orientation = 0;
  const FaceKey key = KeyOf(face, &orientation);
  const auto [it, inserted] = face_index_.try_emplace(key, static_cast<int>(owners_.size() / 2));
  if (inserted) owners_.insert(owners_.end(), 2, kOpen);
  return 2 * it->second + orientation;
}

int WorkingMesh::FindHalfFace(const CellFace& face) const {
  int orientation = 0;
  const FaceKey key = KeyOf(face, &orientation);
  const auto it = face_index_.find(key);
  return it == face_index_.end() ? -1 : 2 * it->second + orientation;
}

uint64_t WorkingMesh::EdgeKey(int32_t a, int32_t b) {
  return (static_cast<uint64_t>(std::min(a, b)) << 32) | static_cast<uint32_t>(std::max(a, b));
}

void WorkingMesh::CountEdges(const CellCorners& corners, int change) {
  for (const auto& [a, b] : EdgesOf(corners)) cells_at_edge_[EdgeKey(a, b)] += change;
}

int WorkingMesh::CellsAtEdge(int32_t a, int32_t b) const {
  const auto it = cells_at_edge_.find(EdgeKey(a, b));
  return it == cells_at_edge_.end() ? 0 : it->second;
}

bool WorkingMesh::IsUsed(const CellFace& face) const {
  const int half = FindHalfFace(face);
  return half >= 0 && (owners_[half] >= 0 || owners_[half ^ 1] >= 0);
}

int WorkingMesh::AddVertex(const Vec3d& position) {
  vertices_.push_back(position);
  return static_cast<int>(vertices_.size()) - 1;
}

int WorkingMesh::AddCell(const CellCorners& corners) {
  const auto type = RecognizeCell(corners);
  if (!type) return -1;
  const CellFaces faces = FacesOf(corners);
  std::array<int, 6> halves{};
  for (int i = 0; i < faces.count; ++i) {
    halves[i] = HalfFace(faces.face[i]);
    if (owners_[halves[i]] != kOpen) return -1;
  }
  const int cell = cell_slots();
  cells_.push_back(corners);
  types_.push_back(*type);
  alive_.push_back(1);
  for (int i = 0; i < faces.count; ++i) owners_[halves[i]] = cell;
  CountEdges(corners, 1);
  return cell;
}

void WorkingMesh::RemoveCell(int cell) {
  alive_[cell] = 0;
  CountEdges(cells_[cell], -1);
  for (const CellFace& face : FacesOf(cells_[cell])) {
    const int half = FindHalfFace(face);
    owners_[half] = kOpen;
    if (owners_[half ^ 1] == kHull) owners_[half ^ 1] = kOpen;
  }
}

void WorkingMesh::MarkHull(const CellFace& outward_face) {
  const int half = FindHalfFace(outward_face);
  if (half >= 0 && owners_[half] >= 0 && owners_[half ^ 1] == kOpen) owners_[half ^ 1] = kHull;
}

void WorkingMesh::UnmarkHull(const CellFace& outward_face) {
  const int half = FindHalfFace(outward_face);
  if (half >= 0 && owners_[half ^ 1] == kHull) owners_[half ^ 1] = kOpen;
}

std::vector<CellFace> WorkingMesh::OpenFaces() const {
  std::vector<CellFace> open;
  for (int cell = 0; cell < cell_slots(); ++cell) {
    if (!alive(cell)) continue;
    for (const CellFace& face : FacesOf(cells_[cell])) {
      if (Across(face) == kOpen) open.push_back(face);
    }
  }
  return open;
}

std::vector<std::vector<int>> WorkingMesh::CellsAtVertices() const {
  std::vector<std::vector<int>> cells(vertices_.size());
  for (int cell = 0; cell < cell_slots(); ++cell) {
    if (!alive(cell)) continue;
    for (const int32_t v : VerticesOf(cells_[cell])) cells[v].push_back(cell);
  }
  return cells;
}

}  // namespace amhex
