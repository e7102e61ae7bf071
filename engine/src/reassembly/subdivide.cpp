#include "reassembly/subdivide.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <vector>

#include "base/status_macros.h"
#include "closure/working_mesh.h"
#include "output/cell_law.h"
#include "topology/face_table.h"
#include "topology/primitive_catalog.h"

namespace amhex {
namespace {

constexpr size_t kCellsPerStopCheck = 4096;

using Edge = std::array<int32_t, 2>;  // the smaller vertex first

Edge EdgeBetween(int32_t a, int32_t b) { return {std::min(a, b), std::max(a, b)}; }

// What one cell contributes around one of its corners: the faces there, in ring order.
struct CornerFan {
  std::vector<int32_t> ends;    // [valence] where the edges lead
  std::vector<CellFace> faces;  // [valence] the face from edge k to edge k + 1
};

// Outward faces run ... before, corner, after ...: the next face of the fan, counter-clockwise seen
// from outside, begins where this one ends.
CornerFan FanAt(const CellCorners& cell, int32_t corner) {
  struct Wedge {
    int32_t before, after;
    CellFace face;
  };
  std::vector<Wedge> wedges;
  for (const CellFace& face : FacesOf(cell)) {
    for (int i = 0; i < face.count; ++i) {
      if (face.v[i] != corner) continue;
      wedges.push_back(
          {face.v[(i + face.count - 1) % face.count], face.v[(i + 1) % face.count], face});
    }
  }
  CornerFan fan;
  int32_t end = wedges.front().after;
  for (size_t k = 0; k < wedges.size(); ++k) {
    const auto next = std::find_if(wedges.begin(), wedges.end(),
                                   [&](const Wedge& wedge) { return wedge.after == end; });
    if (next == wedges.end()) return {};
    fan.ends.push_back(next->after);
    fan.faces.push_back(next->face);
    end = next->before;
  }
  return fan;
}

class Subdivider {
 public:
  Subdivider(const BrokenVolume& volume, const Frame& frame) : volume_(volume) {
    for (const Vec3d& p : volume.vertices) complex_.vertices.push_back(frame.ToNormalized(p));
    AddEdgeVertices();
    AddFaceVertices();
  }

  absl::StatusOr<CellComplex> Run(const RunContext& run) && {
    for (size_t c = 0; c < volume_.cells.size(); ++c) {
      if (c % kCellsPerStopCheck == 0) AMHEX_RETURN_IF_ERROR(run.CheckStop());
      const CellCorners& cell = volume_.cells[c];
      const CellVertices corners = VerticesOf(cell);
      const int32_t centre = AddAverage({corners.begin(), corners.end()});
      for (const int32_t corner : corners) SubdivideCorner(cell, corner, centre);
    }
    for (const CellFace& face : volume_.boundary) MarkHull(face);
    return std::move(complex_);
  }

 private:
  void AddEdgeVertices() {
    for (const CellCorners& cell : volume_.cells) {
      for (const auto& [a, b] : EdgesOf(cell)) edges_.push_back(EdgeBetween(a, b));
    }
    tbb::parallel_sort(edges_.begin(), edges_.end());
    edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
    first_edge_ = static_cast<int32_t>(complex_.vertices.size());
    for (const auto& [a, b] : edges_) AddAverage({a, b});
  }

  void AddFaceVertices() {
    std::vector<CellFace> faces;
    for (const CellCorners& cell : volume_.cells) {
      for (const CellFace& face : FacesOf(cell)) faces.push_back(face);
    }
    faces_ = FaceTable::Build(static_cast<int32_t>(volume_.vertices.size()), faces);
    first_face_ = static_cast<int32_t>(complex_.vertices.size());
    for (int32_t f = 0; f < faces_.count(); ++f) {
      const CellFace& face = faces_.face(f);
      AddAverage({face.v.begin(), face.v.begin() + face.count});
    }
  }

  int32_t AddAverage(const std::vector<int32_t>& vertices) {
    Vec3d sum;
    for (const int32_t v : vertices) sum += complex_.vertices[static_cast<size_t>(v)];
    complex_.vertices.push_back(sum / static_cast<double>(vertices.size()));
    return static_cast<int32_t>(complex_.vertices.size()) - 1;
  }

  int32_t OnEdge(int32_t a, int32_t b) const {
    const auto at = std::lower_bound(edges_.begin(), edges_.end(), EdgeBetween(a, b));
    return first_edge_ + static_cast<int32_t>(at - edges_.begin());
  }
  int32_t OnFace(const CellFace& face) const { return first_face_ + FaceOf(faces_.Find(face)); }

  void SubdivideCorner(const CellCorners& cell, int32_t corner, int32_t centre) {
    const CornerFan fan = FanAt(cell, corner);
    const size_t valence = fan.ends.size();
    if (valence < 3) return;
    std::vector<int32_t> edge, face;
    for (size_t k = 0; k < valence; ++k) {
      edge.push_back(OnEdge(corner, fan.ends[k]));
      face.push_back(OnFace(fan.faces[k]));
    }
    if (valence == 3) {
      // Seen from outside, the edges turn counter-clockwise around the corner.
      AddIfValid({corner, edge[2], face[1], edge[1], edge[0], face[2], centre, face[0]});
      return;
    }
    std::vector<int32_t> around = {corner, centre};
    around.insert(around.end(), edge.begin(), edge.end());
    around.insert(around.end(), face.begin(), face.end());
    const int32_t apex = AddAverage(around);
    for (size_t k = 0; k < valence; ++k) {
      const size_t next = (k + 1) % valence;
      AddIfValid(MakePyramid({corner, edge[k], face[k], edge[next]}, apex));
      AddIfValid(MakePyramid({centre, face[next], edge[next], face[k]}, apex));
    }
  }

  void AddIfValid(const CellCorners& corners) {
    const CellMeasures measures = MeasureCell(corners, complex_.vertices);
    const bool is_lawful =
        measures.volume > 0 && measures.min_scaled_jacobian > 0 && measures.min_map_jacobian > 0;
    if (is_lawful) complex_.cells.push_back(corners);
  }

  void MarkHull(const CellFace& face) {
    const int32_t centre = OnFace(face);
    for (int i = 0; i < face.count; ++i) {
      const int32_t corner = face.v[i];
      const int32_t after = face.v[(i + 1) % face.count];
      const int32_t before = face.v[(i + face.count - 1) % face.count];
      complex_.hull_faces.push_back(
          Quad(corner, OnEdge(corner, after), centre, OnEdge(corner, before)));
    }
  }

  const BrokenVolume& volume_;
  CellComplex complex_;
  std::vector<Edge> edges_;
  FaceTable faces_;
  int32_t first_edge_ = 0, first_face_ = 0;
};

}  // namespace

absl::StatusOr<CellComplex> SubdivideCells(const BrokenVolume& volume, const Frame& frame,
                                           const RunContext& run) {
  return Subdivider(volume, frame).Run(run);
}

}  // namespace amhex
