#include "closure/working_mesh.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <bit>

namespace amhex {
namespace {

// Three in a large mesh of hexahedra; one more for the hull and for smaller cells.
constexpr size_t kFacesPerCell = 4;
// Fewer cells, as of excerpts, are added one by one: those are made on all threads at once.
constexpr size_t kFewestTogether = 16384;
constexpr size_t kVerticesAtOnce = 1024;

}  // namespace

CellEdges EdgesOf(const CellCorners& corners) {
  CellEdges edges;
  const bool is_hexahedron = VerticesOf(corners).count == 8;  // with 12 different edges
  for (const auto& [i, j] : kCubeEdges) {
    const std::array<int32_t, 2> edge = {std::min(corners[i], corners[j]),
                                         std::max(corners[i], corners[j])};
    const bool is_known =
        !is_hexahedron &&
        (edge[0] == edge[1] || std::find(edges.begin(), edges.end(), edge) != edges.end());
    if (is_known) continue;
    edges.edge[edges.count++] = edge;
  }
  return edges;
}

bool HasEdge(const CellCorners& corners, int32_t a, int32_t b) {
  int found = 0;
  for (const auto& [i, j] : kCubeEdges) {
    found |= static_cast<int>(corners[i] == a) & static_cast<int>(corners[j] == b);
    found |= static_cast<int>(corners[i] == b) & static_cast<int>(corners[j] == a);
  }
  return found != 0;
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

Vec3d CellCentroid(const CellCorners& corners, const std::vector<Vec3d>& vertices) {
  const CellVertices own = VerticesOf(corners);
  Vec3d sum;
  for (const int32_t v : own) sum += vertices[v];
  return sum / own.count;
}

Vec3d FaceUnitNormal(const CellFace& face, const std::vector<Vec3d>& vertices) {
  const Vec3d& a = vertices[face.v[0]];
  return Normalized(Cross(vertices[face.v[1]] - a, vertices[face.v[2]] - a));
}

WorkingMesh::WorkingMesh(const CellComplex& complex, const StopPoll& poll)
    : vertices_(complex.vertices) {
  const size_t count = complex.cells.size();
  cells_.reserve(count), types_.reserve(count), alive_.reserve(count), half_faces_.reserve(count);
  faces_.reserve(count * kFacesPerCell);
  owners_.reserve(2 * count * kFacesPerCell);
  first_face_.assign(vertices_.size(), kEnd);
  first_cell_.assign(vertices_.size(), kEnd);
  next_cell_.reserve(count * kMaxVertices);
  if (count < kFewestTogether || !AppendTogether(complex.cells, poll)) {
    AppendOneByOne(complex.cells, poll);
  }
  // Once, as every cell beside another changes what is open of it.
  NoteAllOpen(poll);
  for (const CellFace& face : complex.hull_faces) MarkHull(face);
}

CellComplex WorkingMesh::ToComplex(const StopPoll& poll) const {
  CellComplex complex;
  complex.vertices = vertices_;
  for (int cell = 0; cell < cell_slots(); ++cell) {
    poll.At(cell);
    if (!alive(cell)) continue;
    complex.cells.push_back(cells_[cell]);
    const CellFaces faces = FacesOf(cells_[cell]);
    for (int i = 0; i < faces.count; ++i) {
      if (owners_[half_faces_[cell][i] ^ 1] == kHull) complex.hull_faces.push_back(faces.face[i]);
    }
  }
  return complex;
}

int32_t WorkingMesh::EntryOf(const CellFace& face, FaceEntry* entry, int* orientation) {
  int first = 0;
  for (int j = 1; j < face.count; ++j) {
    if (face.v[j] < face.v[first]) first = j;
  }
  const int32_t next = face.v[(first + 1) % face.count];
  const int32_t previous = face.v[(first + face.count - 1) % face.count];
  *orientation = next < previous ? 1 : 0;
  // The vertex opposite the smallest tells apart the rings that four vertices can form.
  const int32_t opposite = face.count == 4 ? face.v[(first + 2) % 4] : -1;
  *entry = {std::min(next, previous), std::max(next, previous), opposite, kEnd};
  return face.v[first];
}

int32_t WorkingMesh::FindFace(int32_t smallest, const FaceEntry& entry) const {
  if (smallest >= static_cast<int32_t>(first_face_.size())) return kEnd;
  int32_t face = first_face_[smallest];
  for (; face != kEnd; face = faces_[face].next) {
    const FaceEntry& known = faces_[face];
    if (known.low == entry.low && known.high == entry.high && known.opposite == entry.opposite) {
      break;
    }
  }
  return face;
}

int WorkingMesh::HalfFace(const CellFace& face) {
  FaceEntry entry;
  int orientation = 0;
  const int32_t smallest = EntryOf(face, &entry, &orientation);
  int32_t found = FindFace(smallest, entry);
  if (found == kEnd) {
    if (first_face_.size() < vertices_.size()) first_face_.resize(vertices_.size(), kEnd);
    found = static_cast<int32_t>(faces_.size());
    entry.next = first_face_[smallest];
    first_face_[smallest] = found;
    faces_.push_back(entry);
    owners_.insert(owners_.end(), 2, kOpen);
  }
  return 2 * found + orientation;
}

int WorkingMesh::FindHalfFace(const CellFace& face) const {
  FaceEntry entry;
  int orientation = 0;
  const int32_t smallest = EntryOf(face, &entry, &orientation);
  const int32_t found = FindFace(smallest, entry);
  return found == kEnd ? -1 : 2 * found + orientation;
}

void WorkingMesh::LinkCell(int cell) {
  if (first_cell_.size() < vertices_.size()) first_cell_.resize(vertices_.size(), kEnd);
  int32_t link = kMaxVertices * cell;
  next_cell_.resize(static_cast<size_t>(link) + kMaxVertices, kEnd);
  for (const int32_t v : VerticesOf(cells_[cell])) {
    next_cell_[link] = first_cell_[v];
    first_cell_[v] = link++;
  }
}

void WorkingMesh::UnlinkCell(int cell) {
  for (const int32_t v : VerticesOf(cells_[cell])) {
    int32_t* link = &first_cell_[v];
    while (*link / kMaxVertices != cell) link = &next_cell_[*link];
    *link = next_cell_[*link];
  }
}

int WorkingMesh::CellsAtEdge(int32_t a, int32_t b) const {
  if (a >= static_cast<int32_t>(first_cell_.size())) return 0;
  int count = 0;
  for (int32_t link = first_cell_[a]; link != kEnd; link = next_cell_[link]) {
    if (HasEdge(cells_[link / kMaxVertices], a, b)) ++count;
  }
  return count;
}

bool WorkingMesh::IsUsed(const CellFace& face) const {
  const int half = FindHalfFace(face);
  return half >= 0 && (owners_[half] >= 0 || owners_[half ^ 1] >= 0);
}

int WorkingMesh::AddVertex(const Vec3d& position) {
  vertices_.push_back(position);
  return static_cast<int>(vertices_.size()) - 1;
}

void WorkingMesh::AppendOneByOne(const std::vector<CellCorners>& cells, const StopPoll& poll) {
  for (size_t i = 0; i < cells.size(); ++i) {
    poll.At(static_cast<int64_t>(i));
    AppendCell(cells[i], ShapeOf(cells[i]));
  }
}

int WorkingMesh::AddCell(const CellCorners& corners) {
  const int cell = AppendCell(corners, ShapeOf(corners));
  if (cell < 0) return cell;
  NoteOpen(half_faces_[cell][0]);
  for (const int32_t half : half_faces_[cell]) {
    if (half >= 0) NoteOpen(half ^ 1);
  }
  return cell;
}

WorkingMesh::CellShape WorkingMesh::ShapeOf(const CellCorners& corners) {
  return {RecognizeCell(corners), FacesOf(corners)};
}

int WorkingMesh::AppendCell(const CellCorners& corners, const CellShape& shape) {
  if (!shape.type) return -1;
  const CellFaces& faces = shape.faces;
  HalfFaces halves;
  halves.fill(-1);
  for (int i = 0; i < faces.count; ++i) {
    halves[i] = HalfFace(faces.face[i]);
    if (owners_[halves[i]] != kOpen) return -1;
  }
  const int cell = cell_slots();
  cells_.push_back(corners);
  types_.push_back(*shape.type);
  alive_.push_back(1);
  half_faces_.push_back(halves);
  has_open_.resize(static_cast<size_t>(cell) / 64 + 1, 0);
  for (int i = 0; i < faces.count; ++i) owners_[halves[i]] = cell;
  LinkCell(cell);
  return cell;
}

void WorkingMesh::RemoveCell(int cell) {
  if (!alive(cell)) return;
  alive_[cell] = 0;
  UnlinkCell(cell);
  has_open_[cell / 64] &= ~(uint64_t{1} << cell % 64);
  for (const int32_t half : half_faces_[cell]) {
    if (half < 0) break;
    owners_[half] = kOpen;
    if (owners_[half ^ 1] == kHull) owners_[half ^ 1] = kOpen;
    NoteOpen(half ^ 1);
  }
}

void WorkingMesh::NoteOpen(int half_face) {
  const int32_t cell = owners_[half_face];
  if (cell < 0) return;
  const HalfFaces& halves = half_faces_[cell];
  const bool any = std::any_of(halves.begin(), halves.end(), [this](int32_t half) {
    return half >= 0 && owners_[half ^ 1] == kOpen;
  });
  const uint64_t bit = uint64_t{1} << cell % 64;
  uint64_t& word = has_open_[cell / 64];
  word = any ? word | bit : word & ~bit;
}

void WorkingMesh::NoteAllOpen(const StopPoll& poll) {
  constexpr size_t kWordsAtOnce = 64;
  oneapi::tbb::parallel_for(
      oneapi::tbb::blocked_range<size_t>(0, has_open_.size(), kWordsAtOnce),
      [&](const oneapi::tbb::blocked_range<size_t>& range) {
        poll.Now();
        const int end = std::min(cell_slots(), static_cast<int>(64 * range.end()));
        for (int cell = static_cast<int>(64 * range.begin()); cell < end; ++cell) {
          NoteOpen(half_faces_[cell][0]);
        }
      });
}

void WorkingMesh::MarkHull(const CellFace& outward_face) {
  const int half = FindHalfFace(outward_face);
  if (half < 0 || owners_[half] < 0 || owners_[half ^ 1] != kOpen) return;
  owners_[half ^ 1] = kHull;
  NoteOpen(half);
}

void WorkingMesh::UnmarkHull(const CellFace& outward_face) {
  const int half = FindHalfFace(outward_face);
  if (half < 0 || owners_[half ^ 1] != kHull) return;
  owners_[half ^ 1] = kOpen;
  NoteOpen(half);
}

std::vector<CellFace> WorkingMesh::OpenFaces() const {
  std::vector<CellFace> open;
  for (size_t word = 0; word < has_open_.size(); ++word) {
    for (uint64_t bits = has_open_[word]; bits != 0; bits &= bits - 1) {
      const auto cell = static_cast<int>(64 * word) + std::countr_zero(bits);
      const CellFaces faces = FacesOf(cells_[cell]);
      for (int i = 0; i < faces.count; ++i) {
        if (owners_[half_faces_[cell][i] ^ 1] == kOpen) open.push_back(faces.face[i]);
      }
    }
  }
  return open;
}

bool WorkingMesh::HasOpenFaces() const {
  return std::any_of(has_open_.begin(), has_open_.end(), [](uint64_t word) { return word != 0; });
}

std::vector<std::vector<int>> WorkingMesh::CellsAtVertices(const StopPoll& poll) const {
  std::vector<std::vector<int>> cells(vertices_.size());
  // Every list takes memory of its own, which is most of the work.
  oneapi::tbb::parallel_for(
      oneapi::tbb::blocked_range<size_t>(0, first_cell_.size(), kVerticesAtOnce),
      [&](const oneapi::tbb::blocked_range<size_t>& range) {
        poll.Now();
        for (size_t v = range.begin(); v < range.end(); ++v) {
          size_t count = 0;
          AnyCellAt(static_cast<int32_t>(v), [&](int) { return ++count == 0; });
          cells[v].reserve(count);
          AnyCellAt(static_cast<int32_t>(v), [&](int cell) {
            cells[v].push_back(cell);
            return false;
          });
          std::sort(cells[v].begin(), cells[v].end());
        }
      });
  return cells;
}

}  // namespace amhex
