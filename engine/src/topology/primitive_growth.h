// Graph matching as it grows primitives face by face from one starting face; usable where bodies
// run. Section 5.2, II, listings 1 and 2.
#pragma once

#include <array>
#include <cstdint>

#include "amhex/vec3.h"
#include "amhex/volume_mesh.h"
#include "topology/face_complex_view.h"
#include "topology/primitive_programs.h"
#include "topology/shape_overlay.h"

namespace amhex {

// A closed set of faces with the surface of one primitive.
struct FoundPrimitive {
  PrimitiveType type = PrimitiveType::kHexahedron;
  int face_count = 0;
  std::array<int32_t, kMostFaces> faces{};  // ascending ids of the face complex
  CellCorners corners{};                    // of the primitive or of its mirror image
};

// The search from one starting face gives up after this many unfinished primitives; none of the
// networks of section 5.1 comes near it, it bounds the time on hostile ones.
inline constexpr int kMostOpenPrimitives = 1 << 16;

// An unfinished primitive: its faces, and its edges used by one of them or by two.
class OpenPrimitive {
 public:
  AMHEX_HD const ProgramState& state() const { return state_; }
  AMHEX_HD int face_count() const { return face_count_; }
  AMHEX_HD int32_t face(int index) const { return faces_[index]; }

  AMHEX_HD bool Contains(int32_t face) const { return IsAmong(faces_.data(), face_count_, face); }

  // False if some edge would be used three times or there would be more edges than any primitive
  // has; then this is of no more use.
  AMHEX_HD bool AddFace(const FaceComplexView& complex, int32_t face) {
    const int corner_count = complex.faces[face].count;
    for (int i = 0; i < corner_count; ++i) {
      if (!ToggleEdge(complex.edges_of_face[face][i])) return false;
    }
    faces_[face_count_++] = face;
    if (corner_count == 4) {
      ++state_.quads;
    } else {
      ++state_.triangles;
    }
    return true;
  }

  // Secondary faces go on the primary face's open edges in ring order, tertiary ones on the
  // smallest open edge. There is one.
  AMHEX_HD int32_t NextEdge(const FaceComplexView& complex) const {
    const std::array<int32_t, 4>& primary_edges = complex.edges_of_face[faces_[0]];
    if (IsAmong(primary_edges.data(), 4, open_[0])) return open_[0];
    int32_t smallest = open_[0];
    for (int i = 1; i < state_.open_edges; ++i) {
      if (open_[i] < smallest) smallest = open_[i];
    }
    return smallest;
  }

 private:
  static constexpr int kMostEdges = 12;  // of any primitive

  AMHEX_HD static bool IsAmong(const int32_t* ids, int count, int32_t id) {
    for (int i = 0; i < count; ++i) {
      if (ids[i] == id) return true;
    }
    return false;
  }

  // Closes `edge` if it is open, opens it if it is new.
  AMHEX_HD bool ToggleEdge(int32_t edge) {
    if (IsAmong(closed_.data(), closed_count_, edge)) return false;
    int at = 0;
    while (at < state_.open_edges && open_[at] != edge) ++at;
    if (at < state_.open_edges) {
      if (closed_count_ == kMostEdges) return false;
      for (int i = at + 1; i < state_.open_edges; ++i) open_[i - 1] = open_[i];
      --state_.open_edges;
      closed_[closed_count_++] = edge;
      return true;
    }
    if (state_.open_edges == kMostEdges) return false;
    open_[state_.open_edges++] = edge;
    return true;
  }

  int face_count_ = 0;
  std::array<int32_t, kMostFaces> faces_{};
  ProgramState state_;
  int closed_count_ = 0;
  std::array<int32_t, kMostEdges> open_{};  // the first state_.open_edges; the primary's come first
  std::array<int32_t, kMostEdges> closed_{};
};

// Turns the faces until every edge runs once in each direction.
class FaceOrienter {
 public:
  AMHEX_HD explicit FaceOrienter(CellFaces& faces) : faces_(faces) {}

  // False if they cannot be.
  AMHEX_HD bool Orient() {
    is_oriented_[0] = true;
    queued_ = 1;
    for (int head = 0; head < queued_; ++head) {
      if (!OrientNeighbours(queue_[head])) return false;
    }
    return queued_ == faces_.count;
  }

 private:
  AMHEX_HD bool OrientNeighbours(int face) {
    const CellFace from = faces_.face[face];
    for (int i = 0; i < from.count; ++i) {
      const std::array<int32_t, 2> along = {from.v[i], from.v[(i + 1) % from.count]};
      for (int other = 0; other < faces_.count; ++other) {
        if (other == face) continue;
        CellFace& neighbour = faces_.face[other];
        const bool runs_along = FindDirectedEdge(&neighbour, 1, along).face == 0;
        if (!runs_along && FindDirectedEdge(&neighbour, 1, {along[1], along[0]}).face != 0) {
          continue;
        }
        if (is_oriented_[other]) {
          if (runs_along) return false;
          continue;
        }
        if (runs_along) neighbour = BackwardsFromSmallest(neighbour);
        is_oriented_[other] = true;
        queue_[queued_++] = other;
      }
    }
    return true;
  }

  CellFaces& faces_;
  std::array<bool, kMostFaces> is_oriented_{};
  std::array<int, kMostFaces> queue_{};
  int queued_ = 0;
};

// All primitives of one type among the faces, one element per starting face. Topology alone is
// judged: a primitive may be flat, inverted or overlap others.
struct PrimitiveGrowth {
  using Item = FoundPrimitive;
  FaceComplexView complex;
  PrimitiveProgram program;
  PrimitiveShape shape;

  // Depth first, which is the order of listing 2 too: all primitives of a type have as many faces.
  template <class Visit>
  AMHEX_HD void VisitItems(int64_t element, const Visit& visit) const {
    const auto start = static_cast<int32_t>(element);
    if (complex.faces[start].count != program.primary_corners) return;
    std::array<Stage, kMostFaces - 1> stages;
    stages[0].primitive = OpenPrimitive();
    if (!stages[0].primitive.AddFace(complex, start)) return;
    Enter(stages[0]);
    int opened = 1;
    for (int depth = 0; depth >= 0;) {
      Stage& stage = stages[depth];
      if (stage.next == stage.end) {
        --depth;
        continue;
      }
      const int32_t face = complex.faces_of_edge[stage.next++];
      if (WasStart(face, start) || stage.primitive.Contains(face)) continue;
      OpenPrimitive grown = stage.primitive;
      if (!grown.AddFace(complex, face) || !program.IsValid(grown.state())) continue;
      if (grown.state() == program.final_state()) {
        VisitFinished(grown, visit);
      } else if (opened < kMostOpenPrimitives) {
        ++opened;
        ++depth;
        stages[depth].primitive = grown;
        Enter(stages[depth]);
      }
    }
  }

 private:
  // An unfinished primitive and the faces that may be next: [next, end) of faces_of_edge.
  struct Stage {
    OpenPrimitive primitive;
    int32_t next = 0, end = 0;
  };

  AMHEX_HD void Enter(Stage& stage) const {
    const int32_t edge = stage.primitive.NextEdge(complex);
    stage.next = complex.first[edge];
    stage.end = complex.first[edge + 1];
  }

  // Faces of the primary's kind below `start` have been starting faces themselves, so whatever they
  // belong to has been found already.
  AMHEX_HD bool WasStart(int32_t face, int32_t start) const {
    return face < start && complex.faces[face].count == program.primary_corners;
  }

  template <class Visit>
  AMHEX_HD void VisitFinished(const OpenPrimitive& primitive, const Visit& visit) const {
    FoundPrimitive found;
    found.type = program.type;
    CellFaces rings;
    for (; rings.count < primitive.face_count(); ++rings.count) {
      rings.face[rings.count] = complex.faces[primitive.face(rings.count)];
      Insert(primitive.face(rings.count), found);
    }
    if (!FaceOrienter(rings).Orient()) return;
    if (ShapeOverlay(shape, rings).Find(found.corners)) visit(found);
  }

  // Keeps the faces in order.
  AMHEX_HD static void Insert(int32_t face, FoundPrimitive& found) {
    int place = found.face_count++;
    for (; place > 0 && found.faces[place - 1] > face; --place) {
      found.faces[place] = found.faces[place - 1];
    }
    found.faces[place] = face;
  }
};

}  // namespace amhex
