#include "topology/primitive_search.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "topology/parallel_blocks.h"
#include "topology/primitive_catalog.h"
#include "topology/primitive_programs.h"

namespace amhex {
namespace {

constexpr int64_t kFacesPerBlock = 256;
constexpr int kMostEdges = 12;  // of any primitive

// An unfinished primitive: its faces, and its edges used by one of them or by two.
struct OpenPrimitive {
  int face_count = 0;
  std::array<int32_t, 6> faces{};
  ProgramState state;
  int closed_count = 0;
  std::array<int32_t, kMostEdges> open{};  // the first state.open_edges; the primary's come first
  std::array<int32_t, kMostEdges> closed{};

  bool Contains(int32_t face) const {
    return std::find(faces.begin(), faces.begin() + face_count, face) != faces.begin() + face_count;
  }
};

// Closes `edge` if it is open, opens it if it is new; false if two faces use it already or the
// primitive would have more edges than any.
bool ToggleEdge(int32_t edge, OpenPrimitive* primitive) {
  int8_t& open_count = primitive->state.open_edges;
  const auto begin = primitive->open.begin(), end = begin + open_count;
  const auto closed_end = primitive->closed.begin() + primitive->closed_count;
  if (std::find(primitive->closed.begin(), closed_end, edge) != closed_end) return false;
  if (const auto at = std::find(begin, end, edge); at != end) {
    if (primitive->closed_count == kMostEdges) return false;
    std::copy(at + 1, end, at);
    --open_count;
    primitive->closed[primitive->closed_count++] = edge;
    return true;
  }
  if (open_count == kMostEdges) return false;
  primitive->open[open_count++] = edge;
  return true;
}

bool AddFace(const FaceComplex& complex, int32_t face, OpenPrimitive* primitive) {
  const int corner_count = complex.face(face).count;
  for (int i = 0; i < corner_count; ++i) {
    if (!ToggleEdge(complex.edges_of(face)[i], primitive)) return false;
  }
  primitive->faces[primitive->face_count++] = face;
  (corner_count == 4 ? primitive->state.quads : primitive->state.triangles) += 1;
  return true;
}

// Secondary faces go on the primary face's open edges in ring order, tertiary ones on the
// smallest open edge.
int32_t NextEdge(const FaceComplex& complex, const OpenPrimitive& primitive) {
  const std::array<int32_t, 4>& primary_edges = complex.edges_of(primitive.faces[0]);
  const int32_t first = primitive.open[0];
  if (std::find(primary_edges.begin(), primary_edges.end(), first) != primary_edges.end()) {
    return first;
  }
  return *std::min_element(primitive.open.begin(),
                           primitive.open.begin() + primitive.state.open_edges);
}

// Turns the faces until every edge runs once in each direction; false if they cannot be.
bool OrientFaces(std::array<CellFace, 6>* faces, int count) {
  const auto runs = [](const CellFace& face, int32_t from, int32_t to) {
    for (int i = 0; i < face.count; ++i) {
      if (face.v[i] == from && face.v[(i + 1) % face.count] == to) return true;
    }
    return false;
  };
  std::array<bool, 6> is_oriented{true};
  std::array<int, 6> queue{0};
  int queued = 1;
  for (int head = 0; head < queued; ++head) {
    const CellFace from = (*faces)[queue[head]];
    for (int i = 0; i < from.count; ++i) {
      const int32_t a = from.v[i], b = from.v[(i + 1) % from.count];
      for (int other = 0; other < count; ++other) {
        if (other == queue[head]) continue;
        const bool runs_along = runs((*faces)[other], a, b);
        if (!runs_along && !runs((*faces)[other], b, a)) continue;
        if (is_oriented[other]) {
          if (runs_along) return false;
          continue;
        }
        if (runs_along) (*faces)[other] = OppositeHalfFace((*faces)[other]);
        is_oriented[other] = true;
        queue[queued++] = other;
      }
    }
  }
  return queued == count;
}

std::optional<FoundPrimitive> Finish(const FaceComplex& complex, PrimitiveType type,
                                     const OpenPrimitive& primitive) {
  std::array<CellFace, 6> faces;
  for (int i = 0; i < primitive.face_count; ++i) faces[i] = complex.face(primitive.faces[i]);
  if (!OrientFaces(&faces, primitive.face_count)) return std::nullopt;
  const auto corners =
      CornersFromFaces(type, {faces.data(), static_cast<size_t>(primitive.face_count)});
  if (!corners.has_value()) return std::nullopt;
  FoundPrimitive found{type, primitive.face_count, primitive.faces, *corners};
  std::sort(found.faces.begin(), found.faces.begin() + found.face_count);
  return found;
}

// Listing 2. Faces of the primary's kind below `start` have been starting faces themselves, so
// whatever they belong to has been found already.
void FindPrimitivesFrom(const FaceComplex& complex, const PrimitiveProgram& program, int32_t start,
                        std::vector<FoundPrimitive>* found) {
  OpenPrimitive primary;
  AddFace(complex, start, &primary);
  std::vector<OpenPrimitive> open_primitives = {primary};
  while (!open_primitives.empty()) {
    std::vector<OpenPrimitive> next;
    for (const OpenPrimitive& open : open_primitives) {
      for (const int32_t face : complex.faces_at(NextEdge(complex, open))) {
        const bool was_start = face < start && complex.face(face).count == program.primary_corners;
        if (was_start || open.Contains(face)) continue;
        OpenPrimitive grown = open;
        if (!AddFace(complex, face, &grown) || !program.IsValid(grown.state)) continue;
        if (grown.state == program.final_state()) {
          if (auto done = Finish(complex, program.type, grown)) found->push_back(*done);
        } else if (next.size() < static_cast<size_t>(kMostOpenPrimitives)) {
          next.push_back(grown);
        }
      }
    }
    open_primitives = std::move(next);
  }
}

}  // namespace

absl::Status FindPrimitives(const FaceComplex& complex, PrimitiveType type,
                            const RunContext& context, std::vector<FoundPrimitive>* found) {
  const PrimitiveProgram& program = ProgramOf(type);
  return CollectFromBlocks(complex.face_count(), kFacesPerBlock, context, found,
                           [&](int64_t begin, int64_t end, std::vector<FoundPrimitive>* list) {
                             for (int64_t f = begin; f < end && !context.ShouldStop(); ++f) {
                               const auto face = static_cast<int32_t>(f);
                               if (complex.face(face).count != program.primary_corners) continue;
                               FindPrimitivesFrom(complex, program, face, list);
                             }
                           });
}

CellCorners MirrorCorners(PrimitiveType type, const CellCorners& corners) {
  std::array<CellFace, 6> faces;
  size_t count = 0;
  for (const CellFace& face : FacesOf(corners)) faces[count++] = OppositeHalfFace(face);
  return CornersFromFaces(type, {faces.data(), count}).value_or(corners);
}

}  // namespace amhex
