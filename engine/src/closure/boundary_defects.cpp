#include "closure/boundary_defects.h"

#include <algorithm>
#include <map>

#include "input/hull_queries.h"

namespace amhex {
namespace {

// A boundary face whose centre is this far from the hull is none: half an edge length is what a
// missing layer of cells looks like.
constexpr double kMaxBoundaryDistance = 0.75;

using Edge = std::pair<int32_t, int32_t>;

std::vector<CellFace> BoundaryFaces(const WorkingMesh& mesh) {
  std::vector<CellFace> faces;
  for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
    if (!mesh.alive(cell)) continue;
    for (const CellFace& face : FacesOf(mesh.corners(cell))) {
      if (mesh.Across(face) == WorkingMesh::kHull) faces.push_back(face);
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
  DefectFinder(const WorkingMesh& mesh, const Hull& hull)
      : x_(mesh.vertices()), hull_(hull), faces_(BoundaryFaces(mesh)) {
    for (size_t f = 0; f < faces_.size(); ++f) {
      for (int j = 0; j < faces_[f].count; ++j) {
        faces_at_[faces_[f].v[j]].push_back(static_cast<int>(f));
      }
    }
  }

  std::vector<int32_t> Run() {
    FindEdges();
    for (const auto& [vertex, faces] : faces_at_) {
      if (CountSheets(vertex, faces) > 1) defects_.push_back(vertex);
      FindHangingFaces(faces);
    }
    FindFarFaces();
    std::sort(defects_.begin(), defects_.end());
    defects_.erase(std::unique(defects_.begin(), defects_.end()), defects_.end());
    return defects_;
  }

 private:
  void FindEdges() {
    std::map<Edge, int> uses;
    for (const CellFace& face : faces_) {
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
      const Vec3d centre = FaceCentroid(face, x_);
      if (hull_.queries->Closest(centre, kMaxBoundaryDistance).triangle < 0) AddFace(face);
    }
  }

  void AddFace(const CellFace& face) {
    defects_.insert(defects_.end(), face.v.begin(), face.v.begin() + face.count);
  }

  const std::vector<Vec3d>& x_;
  const Hull& hull_;
  std::vector<CellFace> faces_;
  std::map<int32_t, std::vector<int>> faces_at_;
  std::vector<int32_t> defects_;
};

}  // namespace

std::vector<int32_t> FindBoundaryDefects(const WorkingMesh& mesh, const Hull& hull) {
  return DefectFinder(mesh, hull).Run();
}

}  // namespace amhex
