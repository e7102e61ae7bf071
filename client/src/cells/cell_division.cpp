#include "cells/cell_division.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace amhex::client {
namespace {

// Faces after splitting, outward: at most two per face of the cell.
struct SplitFaces {
  int count = 0;
  std::array<Face, 12> face;
  void Add(const Face& added) { face[count++] = added; }
  const Face* begin() const { return face.data(); }
  const Face* end() const { return face.data() + count; }
};

Face Triangle(int32_t a, int32_t b, int32_t c) { return {3, {a, b, c, -1}}; }

bool Contains(const Face& face, int32_t vertex) {
  const auto end = face.vertex.begin() + face.count;
  return std::find(face.vertex.begin(), end, vertex) != end;
}

int PlaceOfLeast(const Face& face) {
  return static_cast<int>(std::min_element(face.vertex.begin(), face.vertex.begin() + face.count) -
                          face.vertex.begin());
}

SplitFaces Split(const FaceList& faces, const FaceDiagonals& diagonals) {
  SplitFaces split;
  for (int f = 0; f < faces.count; ++f) {
    const Face& face = faces.face[f];
    if (diagonals[f] == Diagonal::kNone || face.count != 4) {
      split.Add(face);
      continue;
    }
    const int from = PlaceOfLeast(face) + (diagonals[f] == Diagonal::kBesideLeast ? 1 : 0);
    const auto v = [&](int i) { return face.vertex[(from + i) % 4]; };
    split.Add(Triangle(v(0), v(1), v(2)));
    split.Add(Triangle(v(0), v(2), v(3)));
  }
  return split;
}

// The tetrahedron or pyramid over an outward face, in the patterns of CellType's figure.
CellCorners Over(const Face& face, int32_t apex) {
  const auto& v = face.vertex;
  if (face.count == 3) return {v[0], v[2], v[2], v[1], v[0], apex, apex, v[1]};
  return {apex, v[0], v[0], v[1], apex, v[3], v[3], v[2]};
}

double QualityOf(const std::vector<CellCorners>& cells, const std::vector<Vec3d>& vertices) {
  double quality = 1;
  for (const CellCorners& corners : cells) {
    quality = std::min(quality, ScaledJacobianOfCell(corners, vertices));
    if (!(VolumeOfCell(corners, vertices) > 0)) quality = std::min(quality, 0.0);
  }
  return quality;
}

void KeepBetter(Division candidate, Division* best) {
  if (best->cells.empty() || candidate.quality > best->quality) *best = std::move(candidate);
}

void TryFan(const SplitFaces& faces, int32_t apex, const std::vector<Vec3d>& vertices,
            Division* best) {
  Division fan;
  for (const Face& face : faces) {
    if (!Contains(face, apex)) {
      fan.cells.push_back(Over(face, apex));
    } else if (face.count == 4) {
      return;  // the fan would split it
    }
  }
  fan.quality = QualityOf(fan.cells, vertices);
  KeepBetter(std::move(fan), best);
}

// The vertices of a hexprism, named from the vertex p in which its triangles (p x y) and (p s t)
// meet: the quadrilaterals with p are (p x . t) and (p y . s), and u, w are their vertices
// opposite p.
struct Hexprism {
  int32_t p, x, y, s, t, u, w;
  int face_xt, face_ys;  // numbers of the two quadrilaterals
};

std::optional<Hexprism> AsHexprism(const FaceList& faces) {
  std::vector<Face> triangles;
  for (const Face& face : faces) {
    if (face.count == 3) triangles.push_back(face);
  }
  if (faces.count != 6 || triangles.size() != 2) return std::nullopt;
  Hexprism h{};
  for (Face& triangle : triangles) {
    while (
        !Contains(&triangle == &triangles[0] ? triangles[1] : triangles[0], triangle.vertex[0])) {
      std::rotate(triangle.vertex.begin(), triangle.vertex.begin() + 1,
                  triangle.vertex.begin() + 3);
    }
  }
  h.p = triangles[0].vertex[0];
  h.x = triangles[0].vertex[1], h.y = triangles[0].vertex[2];
  h.s = triangles[1].vertex[1], h.t = triangles[1].vertex[2];
  for (int f = 0; f < faces.count; ++f) {
    const Face& face = faces.face[f];
    if (face.count != 4 || !Contains(face, h.p)) continue;
    const auto place = std::find(face.vertex.begin(), face.vertex.end(), h.p);
    const int32_t opposite = face.vertex[(place - face.vertex.begin() + 2) % 4];
    const bool is_xt = Contains(face, h.x);
    (is_xt ? h.u : h.w) = opposite;
    (is_xt ? h.face_xt : h.face_ys) = f;
  }
  return h;
}

void TryHexprismCut(const FaceList& faces, const FaceDiagonals& diagonals,
                    const std::vector<Vec3d>& vertices, Division* best) {
  const std::optional<Hexprism> h = AsHexprism(faces);
  if (!h || diagonals != HexprismDiagonals(faces)[1]) return;
  Division cut;
  cut.cells = {Over(Face{4, {h->y, h->x, h->t, h->s}}, h->p),
               {h->x, h->u, h->u, h->t, h->y, h->w, h->w, h->s}};
  cut.quality = QualityOf(cut.cells, vertices);
  KeepBetter(std::move(cut), best);
}

// Fans from a point inside; the point is searched for that makes the worst cell best.
class CentreFan {
 public:
  CentreFan(const SplitFaces& faces, const std::vector<Vec3d>& vertices) {
    for (const Face& face : faces) {
      Face local = face;
      for (int i = 0; i < face.count; ++i) local.vertex[i] = Local(face.vertex[i], vertices);
      faces_.Add(local);
    }
    // The point inside is the last of the local vertices.
    points_.push_back({});
    for (const Face& face : faces_) {
      cells_.push_back(Over(face, static_cast<int32_t>(points_.size()) - 1));
    }
  }

  Division Best() {
    Box3d box;
    Vec3d mean;
    for (size_t i = 0; i + 1 < points_.size(); ++i) {
      box.Extend(points_[i]);
      mean += points_[i] / static_cast<double>(points_.size() - 1);
    }
    centre_ = mean, quality_ = QualityAt(mean);
    // A fan from the middle of a cube has 0.41: what is near that need not be searched for.
    constexpr double kGoodQuality = 0.35;
    constexpr int kHalvings = 7;
    Vec3d step = box.Extent() * 0.2;
    for (int round = 0; round < kHalvings && quality_ < kGoodQuality;) {
      if (Improve(step)) continue;
      step = step * 0.5;
      ++round;
    }
    return Finish();
  }

 private:
  int32_t Local(int32_t vertex, const std::vector<Vec3d>& vertices) {
    const auto found = std::find(ids_.begin(), ids_.end(), vertex);
    if (found != ids_.end()) return static_cast<int32_t>(found - ids_.begin());
    ids_.push_back(vertex);
    points_.push_back(vertices[vertex]);
    return static_cast<int32_t>(ids_.size()) - 1;
  }

  double QualityAt(const Vec3d& centre) {
    points_.back() = centre;
    return QualityOf(cells_, points_);
  }

  // Moves along the first axis direction that makes the worst cell better.
  bool Improve(const Vec3d& step) {
    for (int axis = 0; axis < 3; ++axis) {
      for (double sign : {-1.0, 1.0}) {
        Vec3d trial = centre_;
        trial[axis] += sign * step[axis];
        const double quality = QualityAt(trial);
        if (quality <= quality_ + kLeastGain) continue;
        centre_ = trial, quality_ = quality;
        return true;
      }
    }
    return false;
  }

  Division Finish() {
    Division division;
    division.has_centre = true;
    division.centre = centre_;
    division.quality = quality_;
    for (CellCorners corners : cells_) {
      for (int32_t& corner : corners) {
        corner = corner == static_cast<int32_t>(ids_.size()) ? kCentreVertex : ids_[corner];
      }
      division.cells.push_back(corners);
    }
    return division;
  }

  // So that the search ends: the quality cannot rise by this more than a thousand times.
  static constexpr double kLeastGain = 1e-3;

  SplitFaces faces_;
  std::vector<int32_t> ids_;   // vertex numbers of the local vertices
  std::vector<Vec3d> points_;  // and their places
  std::vector<CellCorners> cells_;
  Vec3d centre_;
  double quality_ = -1;
};

}  // namespace

Diagonal DiagonalThrough(const Face& quad, int32_t vertex) {
  const int least = PlaceOfLeast(quad);
  const bool through = quad.vertex[least] == vertex || quad.vertex[(least + 2) % 4] == vertex;
  return through ? Diagonal::kThroughLeast : Diagonal::kBesideLeast;
}

std::array<FaceDiagonals, 2> HexprismDiagonals(const FaceList& faces) {
  std::array<FaceDiagonals, 2> result{};
  const std::optional<Hexprism> h = AsHexprism(faces);
  if (!h) return result;
  for (const auto& [face, end] : {std::pair(h->face_xt, h->x), std::pair(h->face_ys, h->y)}) {
    result[0][face] = DiagonalThrough(faces.face[face], h->p);
    result[1][face] = DiagonalThrough(faces.face[face], end);
  }
  return result;
}

Division DivideCell(const CellCorners& corners, const std::vector<Vec3d>& vertices,
                    const FaceDiagonals& diagonals) {
  const FaceList faces = FacesOfCell(corners);
  const bool splits = diagonals != FaceDiagonals{};
  const std::optional<PrimitiveType> type = TypeOfCell(corners);
  Division best;
  if (!splits && type != PrimitiveType::kSlice && type != PrimitiveType::kHexprism) {
    best.cells = {corners};
    best.quality = QualityOf(best.cells, vertices);
    return best;
  }
  const SplitFaces split = Split(faces, diagonals);
  CellCorners apexes = corners;
  std::sort(apexes.begin(), apexes.end());
  const auto end = std::unique(apexes.begin(), apexes.end());
  for (auto apex = apexes.begin(); apex != end; ++apex) TryFan(split, *apex, vertices, &best);
  TryHexprismCut(faces, diagonals, vertices, &best);
  // Fewer cells are preferred where they are good enough.
  constexpr double kGoodWithoutCentre = 0.2;
  if (best.cells.empty() || best.quality < kGoodWithoutCentre) {
    KeepBetter(CentreFan(split, vertices).Best(), &best);
  }
  return best;
}

}  // namespace amhex::client
