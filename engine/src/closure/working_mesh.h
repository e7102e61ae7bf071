// A mesh under repair: cells come and go, every half-face knows who owns it.
//
// Complete half-face accounting is the guarantee of the closure: if every half-face of a positive
// cell is matched by another cell or lies on the hull, the cells neither overlap nor leave gaps.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "amhex/vec3.h"
#include "amhex/volume_mesh.h"
#include "assembly/cell_complex.h"
#include "base/stop_poll.h"
#include "topology/primitives.h"

namespace amhex {

// The distinct edges of a cell, from its faces; each with its smaller id first.
struct CellEdges {
  int count = 0;
  std::array<std::array<int32_t, 2>, 12> edge{};
  const std::array<int32_t, 2>* begin() const { return edge.data(); }
  const std::array<int32_t, 2>* end() const { return edge.data() + count; }
};
CellEdges EdgesOf(const CellCorners& corners);
// Whether the edge between these two different vertices is one of them.
bool HasEdge(const CellCorners& corners, int32_t a, int32_t b);

// Reverses the orientation of a face.
CellFace Reversed(const CellFace& face);
Vec3d FaceCentroid(const CellFace& face, const std::vector<Vec3d>& vertices);
// The mean of a cell\'s vertices.
Vec3d CellCentroid(const CellCorners& corners, const std::vector<Vec3d>& vertices);
// Unit normal of the face's first two edges.
Vec3d FaceUnitNormal(const CellFace& face, const std::vector<Vec3d>& vertices);

class WorkingMesh {
 public:
  static constexpr int32_t kOpen = -1;
  static constexpr int32_t kHull = -2;

  // These and CellsAtVertices throw RunStopped when `poll` does.
  explicit WorkingMesh(const CellComplex& complex, const StopPoll& poll = {});
  CellComplex ToComplex(const StopPoll& poll = {}) const;

  std::vector<Vec3d>& vertices() { return vertices_; }
  const std::vector<Vec3d>& vertices() const { return vertices_; }
  int cell_slots() const { return static_cast<int>(cells_.size()); }
  bool alive(int cell) const { return alive_[cell] != 0; }
  const CellCorners& corners(int cell) const { return cells_[cell]; }
  PrimitiveType type(int cell) const { return types_[cell]; }
  bool is_hexahedron(int cell) const { return types_[cell] == PrimitiveType::kHexahedron; }

  // Half-faces are numbered 2 * face + orientation; `half ^ 1` looks the other way.
  // Those of a cell, in the order of FacesOf; behind them -1.
  using HalfFaces = std::array<int32_t, 6>;
  const HalfFaces& half_faces(int cell) const { return half_faces_[cell]; }
  int HalfFace(const CellFace& face);            // inserts the face if it is new
  int FindHalfFace(const CellFace& face) const;  // -1 if the face is unknown
  // Cell whose outward face this is, kOpen, or kHull.
  int32_t owner(int half_face) const { return half_face < 0 ? kOpen : owners_[half_face]; }
  int32_t Owner(const CellFace& face) const { return owner(FindHalfFace(face)); }
  // What lies behind an outward face of a cell.
  int32_t Across(const CellFace& face) const {
    const int half = FindHalfFace(face);
    return half < 0 ? kOpen : owners_[half ^ 1];
  }
  // visit(face) for every outward face of a living cell that is on the hull.
  template <class Visit>
  void VisitHullFaces(int cell, const Visit& visit) const {
    const HalfFaces& halves = half_faces_[cell];
    const auto is_on_hull = [&](int32_t half) { return half >= 0 && owners_[half ^ 1] == kHull; };
    if (std::none_of(halves.begin(), halves.end(), is_on_hull)) return;
    const CellFaces faces = FacesOf(cells_[cell]);
    for (int i = 0; i < faces.count; ++i) {
      if (is_on_hull(halves[i])) visit(faces.face[i]);
    }
  }
  // Number of living cells that have the edge.
  int CellsAtEdge(int32_t a, int32_t b) const;
  // True if holds(cell) for a living cell at the vertex.
  template <class Holds>
  bool AnyCellAt(int32_t vertex, const Holds& holds) const {
    if (vertex >= static_cast<int32_t>(first_cell_.size())) return false;
    for (int32_t link = first_cell_[vertex]; link != kEnd; link = next_cell_[link]) {
      if (holds(link / kMaxVertices)) return true;
    }
    return false;
  }
  // True if either side of the face belongs to a cell.
  bool IsUsed(const CellFace& face) const;
  int half_face_count() const { return static_cast<int>(owners_.size()); }

  int AddVertex(const Vec3d& position);
  // Adds a cell; -1, and no change, if it is no known type or one of its half-faces is taken.
  int AddCell(const CellCorners& corners);
  // Removes a living cell; its hull faces stop being hull.
  void RemoveCell(int cell);
  // Declares the far side of a cell's outward face to be the hull, if that side is free.
  void MarkHull(const CellFace& outward_face);
  void UnmarkHull(const CellFace& outward_face);

  // Outward faces of living cells with nothing behind, in cell order. Visits only cells that have
  // any.
  std::vector<CellFace> OpenFaces() const;
  bool HasOpenFaces() const;
  // [vertex] living cells at it, ascending.
  std::vector<std::vector<int>> CellsAtVertices(const StopPoll& poll = {}) const;

 private:
  // A face but for its smallest vertex, whose list it is in.
  struct FaceEntry {
    int32_t low, high;  // neighbours of the smallest vertex
    int32_t opposite;   // -1 in a triangle
    int32_t next;       // face of the same smallest vertex; kEnd
  };
  static constexpr int32_t kEnd = -1;
  static constexpr int kMaxVertices = 8;  // of a cell

  // A face's smallest vertex, entry and orientation.
  static int32_t EntryOf(const CellFace& face, FaceEntry* entry, int* orientation);
  // Face at `smallest` with the vertices of `entry`; kEnd.
  int32_t FindFace(int32_t smallest, const FaceEntry& entry) const;
  // What is known of a cell by its corners alone.
  struct CellShape {
    std::optional<PrimitiveType> type;
    CellFaces faces;
  };
  static CellShape ShapeOf(const CellCorners& corners);
  // Adds a cell without noting which cells have open faces now.
  int AppendCell(const CellCorners& corners, const CellShape& shape);
  // Adds the first cells, as one after the other would be.
  void AppendOneByOne(const std::vector<CellCorners>& cells, const StopPoll& poll);
  // The same on all threads. False, with nothing done, if one of them cannot be added.
  bool AppendTogether(const std::vector<CellCorners>& cells, const StopPoll& poll);
  class Together;
  // Notes of all cells whether they have open faces.
  void NoteAllOpen(const StopPoll& poll);
  void LinkCell(int cell);
  void UnlinkCell(int cell);
  // Notes whether the living cell behind `half_face`, if any, has open faces now.
  void NoteOpen(int half_face);

  std::vector<Vec3d> vertices_;
  std::vector<CellCorners> cells_;
  std::vector<PrimitiveType> types_;
  std::vector<uint8_t> alive_;
  std::vector<HalfFaces> half_faces_;  // [cell]
  std::vector<uint64_t> has_open_;     // bit c % 64 of entry c / 64: the cell has an open face
  std::vector<int32_t> owners_;        // [half_face]
  // Few faces share their smallest vertex, few cells a vertex: lists are faster here than hashing,
  // and a copy of them is a copy of memory.
  std::vector<int32_t> first_face_;  // [vertex] of those whose smallest it is; kEnd
  std::vector<FaceEntry> faces_;     // [face]
  std::vector<int32_t> first_cell_;  // [vertex] link of a living cell at it; kEnd
  std::vector<int32_t> next_cell_;   // [kMaxVertices * cell + k] next link at its k-th vertex
};

}  // namespace amhex
