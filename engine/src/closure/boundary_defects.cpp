#include "closure/boundary_defects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

#include "absl/container/inlined_vector.h"
#include "base/loop_polling.h"
#include "base/sort_unique.h"
#include "fields/point_index.h"
#include "input/ask_hull.h"
#include "input/hull_queries.h"

namespace amhex {
namespace {

// A boundary face whose centre is this far from the hull is none: half an edge length is what a
// missing layer of cells looks like.
constexpr double kMaxBoundaryDistance = 0.75;

// Probes just outside of faces and edges, in fractions of their size; a second covering changes
// the winding number there by one.
constexpr double kProbeOffset = 1e-3;
constexpr double kMaxOutsideWinding = 0.25;
// Faces that fold back on each other leave no direction that is plainly outside.
constexpr double kLeastBisector = 0.05;

// Two quads on three common vertices bound a notch if what they enclose is so thick in the mean, in
// edge lengths of theirs; the validator asks for a little less. A gap of 27 degrees came to
// 0.048 and more where it ends, once the vertices had been moved.
constexpr double kLeastNotch = 0.03;

// Sheets of a boundary that moving a vertex has brought together are this near to it, edge lengths.
constexpr double kReachOfMove = 3.0;

constexpr size_t kFacesPerBlock = 512;
constexpr size_t kCellsPerBlock = 4096;

std::vector<CellFace> BoundaryFaces(const WorkingMesh& mesh, const StopPoll& poll) {
  const auto find = [&](size_t slot, std::vector<CellFace>& faces) {
    const int cell = static_cast<int>(slot);
    if (!mesh.alive(cell)) return;
    mesh.VisitHullFaces(cell, [&](const CellFace& face) { faces.push_back(face); });
  };
  return FindAllPolling<CellFace>(static_cast<size_t>(mesh.cell_slots()), kCellsPerBlock, poll,
                                  find);
}

// Which of the faces are at each vertex that has any.
class FacesAtVertices {
 public:
  FacesAtVertices(const std::vector<CellFace>& faces, size_t vertex_count, const StopPoll& poll)
      : begin_(vertex_count + 1, 0) {
    const auto for_each = [&](const auto& visit) {
      for (size_t f = 0; f < faces.size(); ++f) {
        poll.At(static_cast<int64_t>(f));
        for (int j = 0; j < faces[f].count; ++j) {
          visit(static_cast<size_t>(faces[f].v[j]), static_cast<int>(f));
        }
      }
    };
    for_each([&](size_t v, int) { ++begin_[v + 1]; });
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    face_.resize(begin_.back());
    std::vector<size_t> next(begin_.begin(), begin_.end() - 1);
    for_each([&](size_t v, int f) { face_[next[v]++] = f; });
    for (size_t v = 0; v < vertex_count; ++v) {
      if (begin_[v] < begin_[v + 1]) vertices_.push_back(static_cast<int32_t>(v));
    }
  }
  const std::vector<int32_t>& vertices() const { return vertices_; }
  std::span<const int> operator[](int32_t v) const {
    const size_t begin = begin_[static_cast<size_t>(v)], end = begin_[static_cast<size_t>(v) + 1];
    return {face_.data() + begin, end - begin};
  }

 private:
  std::vector<size_t> begin_;
  std::vector<int> face_;
  std::vector<int32_t> vertices_;
};

// The vertices next to one on a face.
std::array<int32_t, 2> NextTo(int32_t vertex, const CellFace& face) {
  int j = 0;
  while (face.v[j] != vertex) ++j;
  return {face.v[(j + 1) % face.count], face.v[(j + face.count - 1) % face.count]};
}

int SharedVertices(const CellFace& a, const CellFace& b) {
  int shared = 0;
  for (int i = 0; i < a.count; ++i) {
    for (int j = 0; j < b.count; ++j) shared += a.v[i] == b.v[j] ? 1 : 0;
  }
  return shared;
}

// Area vector: of a quad, of its mean plane.
Vec3d AreaVector(const CellFace& face, const std::vector<Vec3d>& x) {
  if (face.count == 3) return Cross(x[face.v[1]] - x[face.v[0]], x[face.v[2]] - x[face.v[0]]);
  return Cross(x[face.v[2]] - x[face.v[0]], x[face.v[3]] - x[face.v[1]]);
}

bool FaceEachOther(const CellFace& a, const CellFace& b, const std::vector<Vec3d>& x) {
  const Vec3d across = FaceCentroid(b, x) - FaceCentroid(a, x);
  const Vec3d na = AreaVector(a, x), nb = AreaVector(b, x);
  return Dot(na, nb) < 0 && Dot(across, na) >= 0 && Dot(across, nb) <= 0;
}

// Whether two faces with three common vertices leave room between them: where a gap between two
// sides of the solid narrows to nothing, a quad of either side meets the other along two edges.
bool BoundNotch(const CellFace& a, const CellFace& b, const std::vector<Vec3d>& x) {
  if (a.count != 4 || b.count != 4) return false;
  const Vec3d area_a = AreaVector(a, x) / 2.0, area_b = AreaVector(b, x) / 2.0;
  // The middles of bilinear patches that differ in one corner are apart as the patches are in the
  // mean.
  const Vec3d apart = FaceCentroid(b, x) - FaceCentroid(a, x);
  const double edge = std::sqrt((Norm(area_a) + Norm(area_b)) / 2);
  return Dot(apart, Normalized(area_a - area_b)) >= kLeastNotch * edge;
}

class DefectFinder {
 public:
  // Looks at all of the faces.
  DefectFinder(const std::vector<Vec3d>& vertices, std::vector<CellFace> faces, const Hull& hull,
               const StopPoll& poll)
      : x_(vertices),
        hull_(hull),
        poll_(poll),
        faces_(std::move(faces)),
        faces_at_(faces_, x_.size(), poll),
        looked_at_(faces_.size()),
        vertices_looked_at_(faces_at_.vertices()) {
    std::iota(looked_at_.begin(), looked_at_.end(), 0);
  }

  // At those near these vertices only.
  void LookNear(const std::vector<int32_t>& vertices) {
    std::vector<Vec3d> centres;
    centres.reserve(faces_.size());
    for (const CellFace& face : faces_) centres.push_back(FaceCentroid(face, x_));
    const fields::PointIndex index(centres, 1.0);
    std::vector<uint8_t> is_near(faces_.size(), 0);
    for (const int32_t v : vertices) {
      poll_.Now();
      index.VisitNear(x_[v], kReachOfMove, [&](int32_t f) { is_near[f] = 1; });
    }
    std::erase_if(looked_at_, [&](int f) { return is_near[f] == 0; });
    std::erase_if(vertices_looked_at_, [&](int32_t v) {
      const std::span<const int> at = faces_at_[v];
      return std::none_of(at.begin(), at.end(), [&](int f) { return is_near[f] != 0; });
    });
  }

  BoundaryDefects Run() const {
    BoundaryDefects found;
    found.vertices = FindUnsound();
    // Sheets that dip into each other are looked for only where the rest is sound.
    const bool is_sound = found.vertices.empty();
    const std::vector<int32_t> far = FindFarFaces();
    found.vertices.insert(found.vertices.end(), far.begin(), far.end());
    if (is_sound) {
      std::vector<int32_t> overlaps = FindOverlaps();
      found.are_just_far = !far.empty() && overlaps.empty();
      if (far.empty()) found.vertices = std::move(overlaps);
    }
    std::sort(found.vertices.begin(), found.vertices.end());
    found.vertices.erase(std::unique(found.vertices.begin(), found.vertices.end()),
                         found.vertices.end());
    return found;
  }

 private:
  using Vertices = std::vector<int32_t>;

  // Where the boundary is no surface.
  Vertices FindUnsound() const {
    return FindAllPolling<int32_t>(vertices_looked_at_.size(), kFacesPerBlock, poll_,
                                   [&](size_t i, Vertices& defects) {
                                     const int32_t v = vertices_looked_at_[i];
                                     if (!IsOneSheet(v)) defects.push_back(v);
                                     FindHangingFaces(faces_at_[v], defects);
                                   });
  }

  // Whether every edge at the vertex has two faces and these are connected through edges.
  bool IsOneSheet(int32_t vertex) const {
    struct Use {
      int32_t other;
      size_t face;  // in the row
    };
    absl::InlinedVector<Use, 16> uses;
    absl::InlinedVector<size_t, 8> group;
    for (const int f : faces_at_[vertex]) {
      for (const int32_t other : NextTo(vertex, faces_[f])) uses.push_back({other, group.size()});
      group.push_back(group.size());
    }
    for (size_t i = 0; i < uses.size(); ++i) {
      int others = 0;
      for (size_t k = 0; k < uses.size(); ++k) {
        if (k == i || uses[k].other != uses[i].other) continue;
        ++others;
        const size_t from = group[uses[k].face], to = group[uses[i].face];
        std::replace(group.begin(), group.end(), from, to);
      }
      if (others != 1) return false;
    }
    return std::all_of(group.begin(), group.end(), [&](size_t g) { return g == group.front(); });
  }

  void FindHangingFaces(const std::span<const int>& faces, Vertices& defects) const {
    for (size_t i = 0; i < faces.size(); ++i) {
      for (size_t k = 0; k < i; ++k) {
        const CellFace& a = faces_[faces[i]];
        const CellFace& b = faces_[faces[k]];
        if (SharedVertices(a, b) < 3 || !FaceEachOther(a, b, x_) || BoundNotch(a, b, x_)) continue;
        AddFace(a, defects);
        AddFace(b, defects);
      }
    }
  }

  Vertices FindFarFaces() const {
    return FindAllPolling<int32_t>(
        looked_at_.size(), kFacesPerBlock, poll_, [&](size_t i, Vertices& defects) {
          const CellFace& face = faces_[looked_at_[i]];
          const HullPoint nearest =
              hull_.queries->Closest(FaceCentroid(face, x_), kMaxBoundaryDistance);
          if (nearest.triangle < 0) AddFace(face, defects);
        });
  }

  // Something of the boundary with a place just outside of it.
  struct Probe {
    CellFace part;  // a face, or an edge's two vertices
    Vec3d place;
  };

  // Faces and edges with the mesh itself just outside of them.
  Vertices FindOverlaps() const {
    const Triangles boundary = Triangulate();
    if (boundary.triangles.empty()) return {};
    const HullQueries queries(boundary.vertices, boundary.triangles, poll_);
    const std::vector<Probe> probes =
        FindAllPolling<Probe>(looked_at_.size(), kFacesPerBlock, poll_, [&](size_t i, auto& found) {
          found.push_back(ProbeOf(faces_[looked_at_[i]]));
          AddEdgeProbes(looked_at_[i], found);
        });
    std::vector<Vec3d> places;
    places.reserve(probes.size());
    for (const Probe& probe : probes) places.push_back(probe.place);
    const std::vector<double> winding =
        HullAsker(queries, nullptr, poll_).AskOrThrow(WindingAround<PlainPoints>{PointsOf(places)});
    Vertices defects;
    for (size_t i = 0; i < probes.size(); ++i) {
      if (winding[i] > kMaxOutsideWinding) AddFace(probes[i].part, defects);
    }
    return defects;
  }

  Probe ProbeOf(const CellFace& face) const {
    const Vec3d area = AreaVector(face, x_);
    return {face,
            FaceCentroid(face, x_) + Normalized(area) * (kProbeOffset * std::sqrt(Norm(area)))};
  }

  // Of the edges whose other face comes later. Of a sound boundary: every edge has two faces.
  void AddEdgeProbes(int face, std::vector<Probe>& found) const {
    for (int j = 0; j < faces_[face].count; ++j) {
      const FaceEdge own{face, j}, other = OtherSideOf(own);
      if (other.face < face) continue;
      const Vec3d normal = NormalBeside(own) + NormalBeside(other);
      if (Norm(normal) < kLeastBisector) continue;
      const int32_t a = Vertex(own, 0), b = Vertex(own, 1);
      const Vec3d place =
          (x_[a] + x_[b]) / 2.0 + Normalized(normal) * (kProbeOffset * Norm(x_[b] - x_[a]));
      found.push_back({{2, {a, b, -1, -1}}, place});
    }
  }
  // Edge j of a face, which leads to the vertex after vertex j.
  struct FaceEdge {
    int face = -1;
    int j = 0;
  };
  int32_t Vertex(const FaceEdge& edge, int ahead) const {
    const CellFace& face = faces_[edge.face];
    return face.v[(edge.j + ahead) % face.count];
  }
  FaceEdge OtherSideOf(const FaceEdge& edge) const {
    const int32_t a = Vertex(edge, 0), b = Vertex(edge, 1);
    for (const int face : faces_at_[a]) {
      for (int j = 0; face != edge.face && j < faces_[face].count; ++j) {
        const FaceEdge other{face, j};
        const int32_t c = Vertex(other, 0), d = Vertex(other, 1);
        if ((a == c && b == d) || (a == d && b == c)) return other;
      }
    }
    return {};
  }
  // Of the face's triangle at the edge, a quad having four around its centre.
  Vec3d NormalBeside(const FaceEdge& edge) const {
    const CellFace& face = faces_[edge.face];
    const Vec3d &a = x_[Vertex(edge, 0)], &b = x_[Vertex(edge, 1)];
    const Vec3d apex = face.count == 4 ? FaceCentroid(face, x_) : x_[Vertex(edge, 2)];
    return Normalized(Cross(b - a, apex - a));
  }

  struct Triangles {
    std::vector<Vec3d> vertices;
    std::vector<std::array<int32_t, 3>> triangles;
  };

  // The boundary as triangles, quads as four around their centre.
  Triangles Triangulate() const {
    Triangles result;
    result.vertices = x_;
    for (const CellFace& face : faces_) {
      poll_.At(static_cast<int64_t>(result.triangles.size()) / 4);
      if (face.count == 3) {
        result.triangles.push_back({face.v[0], face.v[1], face.v[2]});
        continue;
      }
      const auto centre = static_cast<int32_t>(result.vertices.size());
      result.vertices.push_back(FaceCentroid(face, x_));
      for (int j = 0; j < face.count; ++j) {
        result.triangles.push_back({face.v[j], face.v[(j + 1) % face.count], centre});
      }
    }
    return result;
  }

  static void AddFace(const CellFace& face, Vertices& defects) {
    defects.insert(defects.end(), face.v.begin(), face.v.begin() + face.count);
  }

  const std::vector<Vec3d>& x_;
  const Hull& hull_;
  const StopPoll poll_;
  const std::vector<CellFace> faces_;
  const FacesAtVertices faces_at_;
  std::vector<int> looked_at_;               // indices of faces, ascending
  std::vector<int32_t> vertices_looked_at_;  // of the boundary, ascending
};

}  // namespace

BoundaryDefects FindBoundaryDefects(const WorkingMesh& mesh, const Hull& hull,
                                    const StopPoll& poll) {
  return DefectFinder(mesh.vertices(), BoundaryFaces(mesh, poll), hull, poll).Run();
}

std::vector<int32_t> NewBoundaryDefects(const WorkingMesh& before, const WorkingMesh& after,
                                        const Hull& hull, const StopPoll& poll) {
  std::vector<int32_t> all = FindBoundaryDefects(after, hull, poll).vertices;
  if (all.empty()) return all;
  const std::vector<int32_t> old = FindBoundaryDefects(before, hull, poll).vertices;
  std::erase_if(all, [&](int32_t v) { return IsAmong(old, v); });
  return all;
}

BoundaryDefects FindBoundaryDefectsNear(const std::vector<int32_t>& vertices,
                                        const CellComplex& complex, const Hull& hull,
                                        const StopPoll& poll) {
  DefectFinder finder(complex.vertices, complex.hull_faces, hull, poll);
  finder.LookNear(vertices);
  return finder.Run();
}

}  // namespace amhex
