#include "output/validate.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "output/cell_law.h"
#include "output/measure_cells.h"
#include "output/mesh_faces.h"

namespace amhex {
namespace {

// Sums over 10^6 cells in double precision agree to about 1e-12.
constexpr double kVolumeTolerance = 1e-9;
// Qualities are stored as float.
constexpr double kQualityTolerance = 1e-5;

bool ArraysAreSound(const AtMostHexaMesh& mesh, ValidationReport& report) {
  report.array_size_mismatches =
      (mesh.types.size() != mesh.corners.size()) + (mesh.quality.size() != mesh.corners.size());
  const int64_t vertex_count = static_cast<int64_t>(mesh.vertices.size());
  for (const CellCorners& corners : mesh.corners) {
    report.index_out_of_range_count += std::any_of(
        corners.begin(), corners.end(), [&](int32_t v) { return v < 0 || v >= vertex_count; });
  }
  for (const Vec3d& p : mesh.vertices) {
    report.non_finite_vertex_count +=
        !(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
  }
  return report.array_size_mismatches + report.index_out_of_range_count +
             report.non_finite_vertex_count ==
         0;
}

void ExamineCell(const AtMostHexaMesh& mesh, const CellMeasures& measures, size_t c,
                 ValidationReport& report) {
  const std::optional<PrimitiveType> type = TypeByPattern(mesh.corners[c]);
  bool bad = false;
  const auto count_fault = [&](bool fault, int64_t& count) {
    count += fault;
    bad |= fault;
  };
  const double stated = mesh.quality[c];
  count_fault(!type.has_value(), report.unknown_cell_count);
  count_fault(type.has_value() && *type != mesh.types[c], report.wrong_type_count);
  count_fault(!(std::abs(stated - measures.min_scaled_jacobian) <= kQualityTolerance),
              report.wrong_quality_count);
  count_fault(!(measures.volume > 0), report.non_positive_volume_count);
  count_fault(!(measures.min_scaled_jacobian > 0), report.non_positive_scaled_jacobian_count);
  count_fault(!(measures.min_map_jacobian > 0), report.non_positive_map_jacobian_count);
  if (bad && report.first_bad_cell < 0) report.first_bad_cell = static_cast<int64_t>(c);
  report.volume += measures.volume;
  report.min_volume = std::min(report.min_volume, measures.volume);
  report.min_scaled_jacobian = std::min(report.min_scaled_jacobian, measures.min_scaled_jacobian);
  if (measures.volume > 0) {
    report.relative_min_map_jacobian =
        std::min(report.relative_min_map_jacobian, measures.min_map_jacobian / measures.volume);
  }
}

void ExamineCells(const AtMostHexaMesh& mesh, const StopPoll& poll, DeviceUse* device,
                  ValidationReport& report) {
  report.min_volume = report.min_scaled_jacobian = report.relative_min_map_jacobian = 1e300;
  const std::vector<CellMeasures> measures =
      MeasureCells(mesh.corners, mesh.vertices, poll, device);
  for (size_t c = 0; c < mesh.corners.size(); ++c) {
    poll.At(static_cast<int64_t>(c));
    ExamineCell(mesh, measures[c], c, report);
  }
  report.duplicate_cell_count =
      CountDuplicateCells(mesh.corners, static_cast<int64_t>(mesh.vertices.size()), poll);
  std::vector<uint8_t> used(mesh.vertices.size(), 0);
  for (const CellCorners& corners : mesh.corners) {
    for (const int32_t v : corners) used[v] = 1;
  }
  report.unused_vertex_count = std::count(used.begin(), used.end(), 0);
}

double BoundaryVolume(const std::vector<BoundaryFace>& boundary,
                      const std::vector<Vec3d>& vertices) {
  // Cones from the box centre: their signed volumes cancel least there.
  Box3d box;
  for (const Vec3d& p : vertices) box.Extend(p);
  const Vec3d origin = (box.low + box.high) / 2.0;
  double sixfold = 0;
  for (const BoundaryFace& b : boundary) sixfold += SixfoldConeVolume(b.face, vertices, origin);
  return sixfold / 6;
}

void ExamineEmbedding(const AtMostHexaMesh& mesh, const std::vector<BoundaryFace>& boundary,
                      const StopPoll& poll, DeviceUse* device, ValidationReport& report) {
  report.volume_mismatch = std::abs(BoundaryVolume(boundary, mesh.vertices) - report.volume) /
                           std::max(std::abs(report.volume), 1e-300);
  report.overlap = MeasureOverlap(mesh.corners, boundary, mesh.vertices, poll, device);
}

struct NamedCount {
  const char* name;
  int64_t count;
};

std::vector<NamedCount> Faults(const ValidationReport& r) {
  return {
      {"array size mismatches", r.array_size_mismatches},
      {"cells with vertex indices out of range", r.index_out_of_range_count},
      {"non-finite vertices", r.non_finite_vertex_count},
      {"cells of no known type", r.unknown_cell_count},
      {"cells declared as another type", r.wrong_type_count},
      {"cells with a wrong stated quality", r.wrong_quality_count},
      {"cells without positive volume", r.non_positive_volume_count},
      {"cells without positive scaled Jacobian", r.non_positive_scaled_jacobian_count},
      {"cells whose map folds", r.non_positive_map_jacobian_count},
      {"duplicate cells", r.duplicate_cell_count},
      {"unused vertices", r.unused_vertex_count},
      {"faces shared from the same side", r.same_side_face_count},
      {"faces of more than two cells", r.overused_face_count},
      {"open boundary edges", r.boundary.open_edge_count},
      {"non-manifold boundary edges", r.boundary.non_manifold_edge_count},
      {"non-manifold boundary vertices", r.boundary.non_manifold_vertex_count},
      {"flat pockets", r.boundary.flat_pocket_count},
      {"hanging faces", r.boundary.hanging_face_count},
      {"overlapped cell samples", r.overlap.overlapped_cells},
      {"overlapped boundary faces", r.overlap.overlapped_faces},
      {"overlapped boundary edges", r.overlap.overlapped_edges},
      {"boundary volumes that differ from the cells' volume",
       static_cast<int64_t>(!(r.volume_mismatch <= kVolumeTolerance))},
  };
}

}  // namespace

bool ValidationReport::valid() const {
  if (cell_count == 0) return false;
  const std::vector<NamedCount> faults = Faults(*this);
  return std::all_of(faults.begin(), faults.end(), [](const NamedCount& f) { return !f.count; });
}

bool ValidationReport::OnlyOverlaps() const {
  ValidationReport others = *this;
  others.overlap = OverlapReport();
  return others.valid() && !valid();
}

std::string ValidationReport::Summary() const {
  if (cell_count == 0) return "invalid: the mesh has no cells";
  if (valid()) {
    return absl::StrFormat(
        "valid: %d cells, %d vertices, %d boundary faces, %d component(s), genus %d, minimum "
        "scaled Jacobian %.4f",
        cell_count, vertex_count, boundary_face_count, boundary.component_count, boundary.genus,
        min_scaled_jacobian);
  }
  std::string summary = "invalid:";
  const char* separator = " ";
  for (const NamedCount& fault : Faults(*this)) {
    if (fault.count == 0) continue;
    absl::StrAppend(&summary, separator, fault.count, " ", fault.name);
    separator = ", ";
  }
  if (first_bad_cell >= 0) absl::StrAppend(&summary, "; first bad cell ", first_bad_cell);
  return summary;
}

ValidationReport ValidateMesh(const AtMostHexaMesh& mesh, const StopPoll& poll, DeviceUse* device) {
  ValidationReport report;
  report.cell_count = static_cast<int64_t>(mesh.corners.size());
  report.vertex_count = static_cast<int64_t>(mesh.vertices.size());
  if (!ArraysAreSound(mesh, report) || report.cell_count == 0) return report;
  ExamineCells(mesh, poll, device, report);
  const FaceCensus census = CountFaces(mesh.corners, report.vertex_count, poll);
  report.interior_face_count = census.interior_count;
  report.boundary_face_count = static_cast<int64_t>(census.boundary.size());
  report.same_side_face_count = census.same_side_count;
  report.overused_face_count = census.overused_count;
  report.boundary = ExamineBoundary(census.boundary, mesh.vertices, poll);
  if (report.boundary.IsClosedManifold() && !census.boundary.empty()) {
    ExamineEmbedding(mesh, census.boundary, poll, device, report);
  }
  return report;
}

}  // namespace amhex
