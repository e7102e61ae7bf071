#include "reassembly/break_down.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "input/offenders.h"
#include "optimize/cell_quality.h"
#include "output/cell_law.h"
#include "output/finalize_mesh.h"
#include "output/validate.h"
#include "reassembly/polyhedron.h"
#include "topology/face_loops.h"
#include "topology/face_table.h"

namespace amhex {
namespace {

constexpr size_t kCellsPerStopCheck = 4096;

Vec3d AverageOf(const std::vector<Polygon>& faces, const std::vector<Vec3d>& vertices) {
  std::vector<int32_t> used;
  for (const Polygon& face : faces) used.insert(used.end(), face.begin(), face.end());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  Vec3d sum;
  for (const int32_t v : used) sum += vertices[static_cast<size_t>(v)];
  return sum / static_cast<double>(used.size());
}

// The user's own cells are held to nothing stricter than the result is.
bool IsLawful(const CellCorners& corners, const std::vector<Vec3d>& vertices) {
  const CellMeasures measures = MeasureCell(corners, vertices);
  return measures.volume > 0 && measures.min_scaled_jacobian > 0 && measures.min_map_jacobian > 0;
}

class Breaker {
 public:
  explicit Breaker(const VolumeMesh& mesh) : mesh_(mesh) { result_.vertices = mesh.vertices; }

  absl::Status BreakCells(const RunContext& run) {
    Offenders unclosed;
    for (size_t cell = 0; cell < mesh_.cell_faces.size(); ++cell) {
      if (cell % kCellsPerStopCheck == 0) AMHEX_RETURN_IF_ERROR(run.CheckStop());
      std::vector<Polygon> faces = NextFaces(mesh_.cell_faces[cell]);
      if (OrientOutward(mesh_.vertices, &faces)) {
        AddCell(faces, static_cast<int32_t>(cell));
      } else {
        unclosed.Add(cell);
      }
    }
    if (!unclosed.Any()) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat(
        unclosed.Describe("cell"), " is not closed: each of its edges must have two faces"));
  }

  // Needs all cells.
  absl::StatusOr<BrokenVolume> FindBoundary() && {
    const auto vertex_count = static_cast<int32_t>(mesh_.vertices.size());
    const FaceTable table = FaceTable::Build(vertex_count, faces_);
    std::vector<int32_t> owner(static_cast<size_t>(table.half_face_count()), -1);
    Offenders claimed_twice;
    int32_t other = -1;
    for (size_t i = 0; i < faces_.size(); ++i) {
      int32_t& cell = owner[static_cast<size_t>(table.Find(faces_[i]))];
      if (cell >= 0) {
        if (!claimed_twice.Any()) other = cell;
        claimed_twice.Add(static_cast<size_t>(cell_of_face_[i]));
      }
      cell = cell_of_face_[i];
    }
    if (claimed_twice.Any()) {
      return absl::InvalidArgumentError(absl::StrCat(claimed_twice.Describe("cell"),
                                                     " overlaps another one: cell ", other,
                                                     " has a face on the same side"));
    }
    const std::vector<uint8_t> in_slit = FindSlits(table, owner);
    for (HalfFaceId id = 0; id < table.half_face_count(); ++id) {
      if (IsFree(owner, id) && in_slit[static_cast<size_t>(id)] == 0) {
        result_.boundary.push_back(table.half_face(id));
      }
    }
    return std::move(result_);
  }

 private:
  std::vector<Polygon> NextFaces(int32_t count) {
    std::vector<Polygon> faces(static_cast<size_t>(count));
    for (Polygon& face : faces) {
      const auto size = static_cast<size_t>(mesh_.face_corners[next_face_++]);
      const auto begin = mesh_.corners.begin() + static_cast<std::ptrdiff_t>(next_corner_);
      face.assign(begin, begin + static_cast<std::ptrdiff_t>(size));
      next_corner_ += size;
    }
    return faces;
  }

  void AddCell(const std::vector<Polygon>& faces, int32_t cell) {
    const size_t first = faces_.size();
    for (const Polygon& face : faces) CutPolygon(face, &faces_);
    cell_of_face_.resize(faces_.size(), cell);
    const std::optional<CellCorners> corners = CellOfFaces(faces);
    if (corners.has_value() && IsLawful(*corners, result_.vertices)) {
      result_.cells.push_back(*corners);
    } else {
      BreakCell(first, AverageOf(faces, mesh_.vertices));
    }
  }

  // One piece per face around `centre`, if all of them are valid.
  void BreakCell(size_t first_face, const Vec3d& centre) {
    const auto apex = static_cast<int32_t>(result_.vertices.size());
    result_.vertices.push_back(centre);
    std::vector<CellCorners> pieces;
    for (size_t i = first_face; i < faces_.size(); ++i) {
      const auto& v = faces_[i].v;
      pieces.push_back(faces_[i].count == 4 ? MakePyramid(v, apex)
                                            : MakeTetrahedronOn({v[0], v[1], v[2]}, apex));
      if (CellQuality(pieces.back(), result_.vertices) > 0) continue;
      result_.vertices.pop_back();
      ++result_.hollow_count;
      return;
    }
    result_.cells.insert(result_.cells.end(), pieces.begin(), pieces.end());
    ++result_.broken_count;
  }

  // A cell has it, and none lies behind it.
  static bool IsFree(const std::vector<int32_t>& owner, HalfFaceId id) {
    return id != kNoHalfFace && owner[static_cast<size_t>(id)] >= 0 &&
           owner[static_cast<size_t>(OppositeOf(id))] < 0;
  }

  // [half_face_count] 1 for a free quad and the two free triangles that lie against it.
  static std::vector<uint8_t> FindSlits(const FaceTable& table, const std::vector<int32_t>& owner) {
    std::vector<uint8_t> in_slit(owner.size(), 0);
    for (HalfFaceId id = 0; id < table.half_face_count(); ++id) {
      if (table.face(FaceOf(id)).count != 4 || !IsFree(owner, id)) continue;
      const CellFace behind = table.half_face(OppositeOf(id));
      for (int i = 0; i < 2; ++i) {
        const auto at = [&](int k) { return behind.v[(i + k) % 4]; };
        const HalfFaceId one = table.Find({3, {at(0), at(1), at(2), -1}});
        const HalfFaceId two = table.Find({3, {at(0), at(2), at(3), -1}});
        if (!IsFree(owner, one) || !IsFree(owner, two)) continue;
        for (const HalfFaceId part : {id, one, two}) in_slit[static_cast<size_t>(part)] = 1;
      }
    }
    return in_slit;
  }

  const VolumeMesh& mesh_;
  BrokenVolume result_;
  size_t next_face_ = 0, next_corner_ = 0;
  std::vector<CellFace> faces_;  // outward, of all cells, larger polygons cut
  std::vector<int32_t> cell_of_face_;
};

}  // namespace

absl::StatusOr<BrokenVolume> BreakDown(const VolumeMesh& mesh, const RunContext& run) {
  Breaker breaker(mesh);
  AMHEX_RETURN_IF_ERROR(breaker.BreakCells(run));
  return std::move(breaker).FindBoundary();
}

OverlapReport OwnOverlap(const BrokenVolume& volume) {
  if (volume.hollow_count > 0) return {};
  CellComplex complex;
  complex.vertices = volume.vertices;
  complex.cells = volume.cells;
  const ValidationReport report = ValidateMesh(FinalizeMesh(complex, Frame()));
  return report.OnlyOverlaps() ? report.overlap : OverlapReport();
}

TriangleMesh BoundaryOf(const BrokenVolume& volume) {
  TriangleMesh mesh;
  std::vector<int32_t> new_id(volume.vertices.size(), -1);
  const auto renumbered = [&](int32_t v) {
    int32_t& id = new_id[static_cast<size_t>(v)];
    if (id < 0) {
      id = static_cast<int32_t>(mesh.vertices.size());
      mesh.vertices.push_back(volume.vertices[static_cast<size_t>(v)]);
    }
    return id;
  };
  for (const CellFace& face : volume.boundary) {
    std::array<int32_t, 4> v{-1, -1, -1, -1};
    for (int i = 0; i < face.count; ++i) v[i] = renumbered(face.v[i]);
    if (face.count == 3) {
      mesh.triangles.push_back({v[0], v[1], v[2]});
      continue;
    }
    const int first = ShortestDiagonal(face, volume.vertices)[0] == face.v[0] ? 0 : 1;
    const auto at = [&](int k) { return v[(first + k) % 4]; };
    mesh.triangles.push_back({at(0), at(1), at(2)});
    mesh.triangles.push_back({at(0), at(2), at(3)});
  }
  return mesh;
}

}  // namespace amhex
