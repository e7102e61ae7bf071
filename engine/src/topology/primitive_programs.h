// Figure A1 as data: the state machines that assemble each primitive face by face.
//
// A state is a triple: quads, triangles, open edges. A program starts with one primary face. The
// open edges of the primary face are closed first, in the order of its ring (secondary faces);
// what then is open closes from the smallest edge on (tertiary faces). Because one edge is closed
// at a time, every set of faces is built in one way only.
#pragma once

#include <array>
#include <cstdint>

#include "amhex/volume_mesh.h"

namespace amhex {

struct ProgramState {
  int8_t quads = 0;
  int8_t triangles = 0;
  int8_t open_edges = 0;

  friend constexpr bool operator==(const ProgramState& a, const ProgramState& b) {
    return a.quads == b.quads && a.triangles == b.triangles && a.open_edges == b.open_edges;
  }
};

inline constexpr int kMaxProgramStates = 8;

struct PrimitiveProgram {
  PrimitiveType type;
  int primary_corners;  // 3 or 4: the kind of the primary face
  int state_count;
  std::array<ProgramState, kMaxProgramStates> states;  // the initial one first, the final one last

  constexpr const ProgramState& final_state() const { return states[state_count - 1]; }
  constexpr bool IsValid(const ProgramState& state) const {
    for (int i = 0; i < state_count; ++i) {
      if (states[i] == state) return true;
    }
    return false;
  }
};

// Triangles are the better primary face (three branching edges), except where there is none or,
// as in the pyramid, where the quad is the one face that has no equal.
inline constexpr std::array<PrimitiveProgram, 6> kPrimitivePrograms = {{
    {PrimitiveType::kHexahedron,
     4,
     6,
     {{{1, 0, 4}, {2, 0, 6}, {3, 0, 6}, {4, 0, 6}, {5, 0, 4}, {6, 0, 0}}}},
    // The primary triangle's two quads beside the other triangle do not touch: 2/1/7.
    {PrimitiveType::kHexprism,
     3,
     8,
     {{{0, 1, 3}, {1, 1, 5}, {2, 1, 5}, {2, 1, 7}, {3, 1, 5}, {4, 1, 3}, {3, 2, 4}, {4, 2, 0}}}},
    {PrimitiveType::kPrism, 3, 5, {{{0, 1, 3}, {1, 1, 5}, {2, 1, 5}, {3, 1, 3}, {3, 2, 0}}}},
    {PrimitiveType::kSlice,
     3,
     6,
     {{{0, 1, 3}, {1, 1, 5}, {0, 2, 4}, {2, 1, 3}, {1, 2, 4}, {2, 2, 0}}}},
    {PrimitiveType::kPyramid, 4, 5, {{{1, 0, 4}, {1, 1, 5}, {1, 2, 4}, {1, 3, 3}, {1, 4, 0}}}},
    {PrimitiveType::kTetrahedron, 3, 4, {{{0, 1, 3}, {0, 2, 4}, {0, 3, 3}, {0, 4, 0}}}},
}};

constexpr const PrimitiveProgram& ProgramOf(PrimitiveType type) {
  for (const PrimitiveProgram& program : kPrimitivePrograms) {
    if (program.type == type) return program;
  }
  return kPrimitivePrograms.back();
}

}  // namespace amhex
