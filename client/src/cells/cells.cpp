#include "cells/cells.h"

#include <algorithm>
#include <cmath>

namespace amhex::client {
namespace {

// The six faces of the hexahedron by corner, outward.
constexpr std::array<std::array<int, 4>, 6> kFaceCorners = {
    {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}};

// Parametric coordinates of the corners.
constexpr std::array<std::array<int, 3>, 8> kCornerSigns = {{{-1, -1, -1},
                                                             {1, -1, -1},
                                                             {1, 1, -1},
                                                             {-1, 1, -1},
                                                             {-1, -1, 1},
                                                             {1, -1, 1},
                                                             {1, 1, 1},
                                                             {-1, 1, 1}}};

constexpr int kMaxHalfEdges = 24;

struct HalfEdges {
  int count = 0;
  std::array<std::array<int32_t, 2>, kMaxHalfEdges> edge;
};

HalfEdges HalfEdgesOf(const FaceList& faces) {
  HalfEdges half_edges;
  for (const Face& face : faces) {
    for (int i = 0; i < face.count; ++i) {
      half_edges.edge[half_edges.count++] = {face.vertex[i], face.vertex[(i + 1) % face.count]};
    }
  }
  return half_edges;
}

int CountOf(const HalfEdges& edges, int32_t from, int32_t to) {
  int count = 0;
  for (int i = 0; i < edges.count; ++i) {
    if (edges.edge[i][0] == from && edges.edge[i][1] == to) ++count;
  }
  return count;
}

bool IsClosed(const HalfEdges& edges) {
  for (int i = 0; i < edges.count; ++i) {
    const auto& [from, to] = edges.edge[i];
    if (CountOf(edges, from, to) != 1 || CountOf(edges, to, from) != 1) return false;
  }
  return true;
}

int DistinctVertices(const CellCorners& corners) {
  CellCorners sorted = corners;
  std::sort(sorted.begin(), sorted.end());
  return static_cast<int>(std::unique(sorted.begin(), sorted.end()) - sorted.begin());
}

}  // namespace

FaceList FacesOfCell(const CellCorners& corners) {
  FaceList faces;
  for (int side = 0; side < static_cast<int>(kFaceCorners.size()); ++side) {
    Face face;
    for (int corner : kFaceCorners[side]) {
      const int32_t vertex = corners[corner];
      const auto end = face.vertex.begin() + face.count;
      if (std::find(face.vertex.begin(), end, vertex) == end) face.vertex[face.count++] = vertex;
    }
    if (face.count < 3) continue;
    faces.side[faces.count] = side;
    faces.face[faces.count++] = face;
  }
  return faces;
}

std::optional<PrimitiveType> TypeOfCell(const CellCorners& corners) {
  const FaceList faces = FacesOfCell(corners);
  if (!IsClosed(HalfEdgesOf(faces))) return std::nullopt;
  const auto quads =
      std::count_if(faces.begin(), faces.end(), [](const Face& f) { return f.count == 4; });
  const auto triangles = faces.count - quads;
  struct Shape {
    int vertices, quads, triangles;
    PrimitiveType type;
  };
  constexpr std::array<Shape, 6> kShapes = {{{8, 6, 0, PrimitiveType::kHexahedron},
                                             {7, 4, 2, PrimitiveType::kHexprism},
                                             {6, 3, 2, PrimitiveType::kPrism},
                                             {5, 2, 2, PrimitiveType::kSlice},
                                             {5, 1, 4, PrimitiveType::kPyramid},
                                             {4, 0, 4, PrimitiveType::kTetrahedron}}};
  const int vertices = DistinctVertices(corners);
  for (const Shape& shape : kShapes) {
    if (shape.vertices == vertices && shape.quads == quads && shape.triangles == triangles) {
      return shape.type;
    }
  }
  return std::nullopt;
}

double VolumeOfCell(const CellCorners& corners, const std::vector<Vec3d>& vertices) {
  // Relative to a corner, so that cells far from the origin keep their digits.
  const Vec3d origin = vertices[corners[0]];
  const double gauss = 1 / std::sqrt(3.0);
  double volume = 0;
  for (const auto& point : kCornerSigns) {
    std::array<Vec3d, 3> tangent{};
    for (int c = 0; c < 8; ++c) {
      std::array<double, 3> factor{};
      for (int axis = 0; axis < 3; ++axis) {
        factor[axis] = 0.5 * (1 + kCornerSigns[c][axis] * gauss * point[axis]);
      }
      const Vec3d p = vertices[corners[c]] - origin;
      for (int axis = 0; axis < 3; ++axis) {
        const double others = factor[(axis + 1) % 3] * factor[(axis + 2) % 3];
        tangent[axis] += p * (0.5 * kCornerSigns[c][axis] * others);
      }
    }
    volume += Determinant(tangent[0], tangent[1], tangent[2]);
  }
  return volume;
}

double ScaledJacobianOfCell(const CellCorners& corners, const std::vector<Vec3d>& vertices) {
  const HalfEdges edges = HalfEdgesOf(FacesOfCell(corners));
  double minimum = 1;
  for (int i = 0; i < edges.count; ++i) {
    const int32_t v = edges.edge[i][0];
    std::array<int32_t, kMaxHalfEdges> next{};
    int valence = 0;
    for (int k = 0; k < edges.count; ++k) {
      if (edges.edge[k][0] == v) next[valence++] = edges.edge[k][1];
    }
    if (valence != 3) continue;
    // The neighbours a, b, c are in the order that makes an outward corner positive when a face
    // comes from a, passes v and goes on to b.
    const int32_t a = next[0];
    int32_t b = -1;
    const FaceList faces = FacesOfCell(corners);
    for (const Face& face : faces) {
      for (int k = 0; k < face.count; ++k) {
        const int32_t before = face.vertex[(k + face.count - 1) % face.count];
        const int32_t after = face.vertex[(k + 1) % face.count];
        if (face.vertex[k] == v && before == a) b = after;
      }
    }
    const int32_t c = next[1] == b ? next[2] : next[1];
    const Vec3d p = vertices[v];
    const double corner_value = Determinant(
        Normalized(vertices[a] - p), Normalized(vertices[b] - p), Normalized(vertices[c] - p));
    minimum = std::min(minimum, corner_value);
  }
  return minimum;
}

Vec3d CentreOfCell(const CellCorners& corners, const std::vector<Vec3d>& vertices) {
  Vec3d sum;
  int count = 0;
  for (int i = 0; i < 8; ++i) {
    if (std::find(corners.begin(), corners.begin() + i, corners[i]) != corners.begin() + i) {
      continue;
    }
    sum += vertices[corners[i]];
    ++count;
  }
  return sum / static_cast<double>(count);
}

const char* PrimitiveName(PrimitiveType type) {
  switch (type) {
    case PrimitiveType::kTetrahedron:
      return "tetrahedron";
    case PrimitiveType::kPyramid:
      return "pyramid";
    case PrimitiveType::kSlice:
      return "slice";
    case PrimitiveType::kPrism:
      return "prism";
    case PrimitiveType::kHexprism:
      return "hexprism";
    case PrimitiveType::kHexahedron:
      return "hexahedron";
  }
  return "unknown";
}

}  // namespace amhex::client
