#include "assembly/overlap.h"

#include <algorithm>

#include "topology/primitives.h"

namespace amhex {
namespace {

// Samples move this far from the surface towards the centre: a tenth of a unit cube's edge.
// Neighbours across a slit overlap by less than that, and closing the slit cures it.
constexpr double kShrinkage = 0.2;

// The vertex of a slice that lies on an edge of its tetrahedron, or -1 on other cells: two quads
// meet there and nothing else. Without it they are the tetrahedron's plane triangles.
int32_t VertexOnEdge(const CellVertices& ids, const CellFaces& faces) {
  for (const int32_t v : ids) {
    int uses = 0;
    for (const CellFace& face : faces) {
      uses += static_cast<int>(std::count(face.v.begin(), face.v.begin() + face.count, v));
    }
    if (uses == 2) return v;
  }
  return -1;
}

Vec3d Shrunk(const Vec3d& point, const Vec3d& centre) {
  return point + (centre - point) * kShrinkage;
}

bool Meet(const Box3d& a, const Box3d& b) {
  for (int axis = 0; axis < 3; ++axis) {
    if (a.low[axis] > b.high[axis] || b.low[axis] > a.high[axis]) return false;
  }
  return true;
}

CellFace Without(const CellFace& face, int32_t vertex) {
  CellFace kept;
  for (int i = 0; i < face.count; ++i) {
    if (face.v[i] != vertex) kept.v[kept.count++] = face.v[i];
  }
  return kept;
}

}  // namespace

CellExtent::CellExtent(const CellCorners& corners, const std::vector<Vec3d>& vertices) {
  const CellVertices ids = VerticesOf(corners);
  for (const int32_t v : ids) {
    centre += vertices[v];
    box.Extend(vertices[v]);
  }
  centre /= ids.count;
  sample_box = {Shrunk(box.low, centre), Shrunk(box.high, centre)};
}

bool MayOverlap(const CellExtent& a, const CellExtent& b) {
  return Meet(a.sample_box, b.box) || Meet(b.sample_box, a.box);
}

CellBody::CellBody(const CellCorners& corners, const std::vector<Vec3d>& vertices)
    : extent_(corners, vertices) {
  const CellVertices ids = VerticesOf(corners);
  const CellFaces faces = FacesOf(corners);
  const auto add_sample = [&](const Vec3d& point) {
    samples_[sample_count_++] = Shrunk(point, extent_.centre);
  };
  add_sample(extent_.centre);
  for (const int32_t v : ids) add_sample(vertices[v]);
  const int32_t on_edge = VertexOnEdge(ids, faces);
  for (const CellFace& whole : faces) {
    Vec3d face_centre;
    for (int i = 0; i < whole.count; ++i) {
      const int32_t a = whole.v[i], b = whole.v[(i + 1) % whole.count];
      face_centre += vertices[a];
      if (a < b) add_sample((vertices[a] + vertices[b]) * 0.5);
    }
    add_sample(face_centre / whole.count);
    const CellFace face = Without(whole, on_edge);
    for (int i = 0; i < (face.count == 3 ? 1 : 4); ++i) {
      const Vec3d& a = vertices[face.v[i]];
      const Vec3d normal = Cross(vertices[face.v[(i + 1) % face.count]] - a,
                                 vertices[face.v[(i + 2) % face.count]] - a);
      planes_[plane_count_++] = {normal, Dot(normal, a)};
    }
  }
}

bool CellBody::Contains(const Vec3d& p) const {
  if (!Meet({p, p}, extent_.box)) return false;
  for (int i = 0; i < plane_count_; ++i) {
    if (Dot(planes_[i].normal, p) >= planes_[i].offset) return false;
  }
  return true;
}

bool CellBody::ContainsSampleOf(const CellBody& other) const {
  for (int i = 0; i < other.sample_count_; ++i) {
    if (Contains(other.samples_[i])) return true;
  }
  return false;
}

bool Overlap(const CellBody& a, const CellBody& b) {
  if (!MayOverlap(a.extent_, b.extent_)) return false;
  return a.ContainsSampleOf(b) || b.ContainsSampleOf(a);
}

}  // namespace amhex
