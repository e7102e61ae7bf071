#include "closure/boundary_defects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

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

using Edge = std::pair<int32_t, int32_t>;

std::vector<CellFace> BoundaryFaces(const WorkingMesh& mesh, const StopPoll& poll) {
  std::vector<CellFace> faces;
  for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
    poll.At(cell);
    if (!mesh.alive(cell)) continue;
    const WorkingMesh::HalfFaces& halves = mesh.half_faces(cell);
    const auto is_hull = [&](int32_t half) {
      return half >= 0 && mesh.owner(half ^ 1) == WorkingMesh::kHull;
    };
    if (std::none_of(halves.begin(), halves.end(), is_hull)) continue;
    const CellFaces own = FacesOf(mesh.corners(cell));
    for (int i = 0; i < own.count; ++i) {
      if (is_hull(halves[i])) faces.push_back(own.face[i]);
    }
  }
  return faces;
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

class DefectFinder {
 public:
  DefectFinder(const WorkingMesh& mesh, const Hull& hull, const StopPoll& poll)
      : x_(mesh.vertices()), hull_(hull), poll_(poll), faces_(BoundaryFaces(mesh, poll)) {
    for (size_t f = 0; f < faces_.size(); ++f) {
      poll_.At(static_cast<int64_t>(f));
      for (int j = 0; j < faces_[f].count; ++j) {
        faces_at_[faces_[f].v[j]].push_back(static_cast<int>(f));
      }
    }
  }

  BoundaryDefects Run() {
    FindEdges();
    for (const auto& [vertex, faces] : faces_at_) {
      poll_.At(++visited_);
      if (CountSheets(vertex, faces) > 1) defects_.push_back(vertex);
      FindHangingFaces(faces);
    }
    // Sheets that dip into each other are looked for only where the rest is sound.
    const bool is_sound = defects_.empty();
    FindFarFaces();
    BoundaryDefects found;
    std::swap(found.vertices, defects_);
    if (is_sound) FindOverlaps();
    found.are_just_far = !found.vertices.empty() && is_sound && defects_.empty();
    if (found.vertices.empty()) std::swap(found.vertices, defects_);
    std::sort(found.vertices.begin(), found.vertices.end());
    found.vertices.erase(std::unique(found.vertices.begin(), found.vertices.end()),
                         found.vertices.end());
    return found;
  }

 private:
  void FindEdges() {
    std::map<Edge, int> uses;
    for (const CellFace& face : faces_) {
      poll_.At(++visited_);
      for (int j = 0; j < face.count; ++j) {
        ++uses[std::minmax(face.v[j], face.v[(j + 1) % face.count])];
      }
    }
    for (const auto& [edge, count] : uses) {
      if (count == 2) continue;
      defects_.push_back(edge.first);
      defects_.push_back(edge.second);
    }
  }

  // Groups of the faces at a vertex that are connected through its edges.
  int CountSheets(int32_t vertex, const std::vector<int>& faces) const {
    std::vector<int> group(faces.size());
    for (size_t i = 0; i < faces.size(); ++i) group[i] = static_cast<int>(i);
    std::map<int32_t, size_t> first_with;  // neighbour vertex -> face
    for (size_t i = 0; i < faces.size(); ++i) {
      const CellFace& face = faces_[faces[i]];
      for (int j = 0; j < face.count; ++j) {
        if (face.v[j] != vertex) continue;
        for (const int32_t other :
             {face.v[(j + 1) % face.count], face.v[(j + face.count - 1) % face.count]}) {
          const auto [it, inserted] = first_with.try_emplace(other, i);
          if (inserted) continue;
          const int from = group[i], to = group[it->second];
          std::replace(group.begin(), group.end(), from, to);
        }
      }
    }
    std::sort(group.begin(), group.end());
    return static_cast<int>(std::unique(group.begin(), group.end()) - group.begin());
  }

  void FindHangingFaces(const std::vector<int>& faces) {
    for (size_t i = 0; i < faces.size(); ++i) {
      for (size_t k = 0; k < i; ++k) {
        const CellFace& a = faces_[faces[i]];
        const CellFace& b = faces_[faces[k]];
        if (SharedVertices(a, b) < 3 || !FaceEachOther(a, b, x_)) continue;
        AddFace(a);
        AddFace(b);
      }
    }
  }

  void FindFarFaces() {
    for (const CellFace& face : faces_) {
      poll_.At(++visited_);
      const Vec3d centre = FaceCentroid(face, x_);
      if (hull_.queries->Closest(centre, kMaxBoundaryDistance).triangle < 0) AddFace(face);
    }
  }

  // Faces and edges with the mesh itself just outside of them.
  void FindOverlaps() {
    const Triangles boundary = Triangulate();
    if (boundary.triangles.empty()) return;
    const HullQueries queries(boundary.vertices, boundary.triangles, poll_);
    std::vector<Vec3d> probes;  // of the faces, then of the edges
    for (const CellFace& face : faces_) {
      const Vec3d area = AreaVector(face, x_);
      probes.push_back(FaceCentroid(face, x_) +
                       Normalized(area) * (kProbeOffset * std::sqrt(Norm(area))));
    }
    std::vector<Edge> edges;
    for (const auto& [edge, normal] : boundary.edge_normals) {
      if (Norm(normal) < kLeastBisector) continue;
      const Vec3d &a = x_[edge.first], &b = x_[edge.second];
      edges.push_back(edge);
      probes.push_back((a + b) / 2.0 + Normalized(normal) * (kProbeOffset * Norm(b - a)));
    }
    const std::vector<double> winding =
        HullAsker(queries, nullptr, poll_).AskOrThrow(WindingAround<PlainPoints>{PointsOf(probes)});
    for (size_t f = 0; f < faces_.size(); ++f) {
      if (winding[f] > kMaxOutsideWinding) AddFace(faces_[f]);
    }
    for (size_t e = 0; e < edges.size(); ++e) {
      if (!(winding[faces_.size() + e] > kMaxOutsideWinding)) continue;
      defects_.push_back(edges[e].first);
      defects_.push_back(edges[e].second);
    }
  }

  struct Triangles {
    std::vector<Vec3d> vertices;
    std::vector<std::array<int32_t, 3>> triangles;
    std::map<Edge, Vec3d> edge_normals;  // sums of both surface normals
  };

  // The boundary as triangles, quads as four around their centre.
  Triangles Triangulate() const {
    Triangles result;
    result.vertices = x_;
    for (const CellFace& face : faces_) {
      poll_.At(static_cast<int64_t>(result.triangles.size()) / 4);
      const auto centre = static_cast<int32_t>(result.vertices.size());
      if (face.count == 4) result.vertices.push_back(FaceCentroid(face, x_));
      for (int j = 0; j < face.count; ++j) {
        const int32_t a = face.v[j], b = face.v[(j + 1) % face.count];
        const Vec3d apex = face.count == 4 ? result.vertices[centre] : x_[face.v[(j + 2) % 3]];
        if (face.count == 4) result.triangles.push_back({a, b, centre});
        result.edge_normals[std::minmax(a, b)] += Normalized(Cross(x_[b] - x_[a], apex - x_[a]));
      }
      if (face.count == 3) result.triangles.push_back({face.v[0], face.v[1], face.v[2]});
    }
    return result;
  }

  void AddFace(const CellFace& face) {
    defects_.insert(defects_.end(), face.v.begin(), face.v.begin() + face.count);
  }

  const std::vector<Vec3d>& x_;
  const Hull& hull_;
  const StopPoll poll_;
  int64_t visited_ = 0;  // vertices and faces, for the poll
  std::vector<CellFace> faces_;
  std::map<int32_t, std::vector<int>> faces_at_;
  std::vector<int32_t> defects_;
};

}  // namespace

BoundaryDefects FindBoundaryDefects(const WorkingMesh& mesh, const Hull& hull,
                                    const StopPoll& poll) {
  return DefectFinder(mesh, hull, poll).Run();
}

}  // namespace amhex
