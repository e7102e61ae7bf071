// What a run would cost, told from the input's volume and the wanted size alone.
#include <algorithm>
#include <cmath>
#include <optional>
#include <variant>

#include "absl/strings/str_cat.h"
#include "amhex/mesher.h"
#include "base/status_macros.h"
#include "cost_model.h"
#include "cuda/cuda_library.h"
#include "input/drop_strays.h"
#include "input/edge_length.h"
#include "input/hull_checks.h"
#include "input/triangle_math.h"
#include "relax/device_memory.h"
#include "relax/relaxation.h"
#include "trials.h"

namespace amhex {
namespace {

// A solid whose surface does not say how much it holds (clouds, soups) is taken to fill this share
// of its box.
constexpr double kTypicalFill = 0.5;
// Signed volumes below this share of the box are not to be believed, because of openings and mixed
// orientation, unless the triangles' area vectors add up to no more than this share of the area, as
// those of closed surfaces do: a stick across its box fills next to nothing of it.
constexpr double kSmallestBelievedFill = 0.02;
constexpr double kClosedRatio = 1e-6;

Box3d BoxOf(const std::vector<Vec3d>& points) {
  Box3d box;
  for (const Vec3d& p : points) box.Extend(p);
  return box;
}

double BoxVolume(const Box3d& box) {
  const Vec3d e = box.Extent();
  return e.x * e.y * e.z;
}

double VolumeGuess(const TriangleMesh& mesh) {
  Box3d box;  // vertices that no triangle uses may lie anywhere
  for (const auto& t : mesh.triangles) {
    for (const int32_t v : t) box.Extend(mesh.vertices[static_cast<size_t>(v)]);
  }
  const Vec3d centre = (box.low + box.high) / 2.0;
  double volume = 0, area = 0;
  Vec3d area_vector;
  for (const auto& t : mesh.triangles) {
    const Vec3d a = mesh.vertices[static_cast<size_t>(t[0])] - centre;
    const Vec3d b = mesh.vertices[static_cast<size_t>(t[1])] - centre;
    const Vec3d c = mesh.vertices[static_cast<size_t>(t[2])] - centre;
    volume += Determinant(a, b, c) / 6;
    const Vec3d twice = DoubleAreaVector(a, b, c);
    area_vector += twice, area += Norm(twice);
  }
  volume = std::abs(volume);
  const double box_volume = BoxVolume(box);
  const bool is_closed = Norm(area_vector) <= kClosedRatio * area;
  const bool believed = volume <= box_volume && volume > 0 &&
                        (is_closed || volume > kSmallestBelievedFill * box_volume);
  return believed ? volume : kTypicalFill * box_volume;
}

// What becomes of cells that are there already: reassembly makes them fewer, subdivision puts one
// around every corner, of which faces have three or four and each belongs to three faces.
double CellsFromVolume(const VolumeMesh& mesh, VolumeUse use) {
  return use == VolumeUse::kSubdivide ? static_cast<double>(mesh.corners.size()) / 3
                                      : static_cast<double>(mesh.cell_faces.size());
}

double WantedCells(const SizingParams& sizing, double volume) {
  if (sizing.cell_count > 0) return static_cast<double>(sizing.cell_count);
  if (sizing.edge_length > 0) return volume / std::pow(sizing.edge_length, 3);
  return static_cast<double>(kDefaultCellCount);
}

// Memory is set aside for as many: thin parts may raise the default number up to a bound.
int64_t MostCells(const SizingParams& sizing, int64_t cell_count) {
  const bool by_default = sizing.cell_count <= 0 && sizing.edge_length <= 0;
  return by_default ? std::max(cell_count, kMaxDefaultCellCount) : cell_count;
}

double SecondsOfHull(int64_t cell_count, const MeshingParams& params, int64_t input_elements) {
  return ExpectedSeconds({cell_count, input_elements,
                          CountOfTrials(static_cast<double>(cell_count), params),
                          ResolveIterationCount(params.relaxation)});
}

// The most that any step takes on a device; each gives back all but the hull before the next
// begins.
int64_t DeviceBytes(int64_t cell_count, int64_t triangle_count, const MeshingParams& params) {
  const bool has_fields = params.relaxation.initialization == Initialization::kField;
  const int64_t step = std::max(
      {ExpectedRelaxationBytes(cell_count, kTypicalFill, params.relaxation),
       kDeviceBytesPerPlacedCell * cell_count + kDeviceBytesPerPatchTriangle * triangle_count,
       has_fields ? ExpectedFieldBytes(cell_count) : 0});
  return step + kDeviceBytesPerTriangle * triangle_count;
}

absl::Status CheckDeviceMemory(const CostEstimate& estimate) {
  const int64_t total = CudaMemoryBytes();
  if (total == 0 || estimate.device_memory_bytes <= total) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat(
      "about ", estimate.device_memory_bytes, " bytes of device memory are needed for ",
      estimate.cell_count, " cells, the CUDA device has ", total));
}

}  // namespace

absl::StatusOr<CostEstimate> EstimateCost(const InputHull& hull, const MeshingParams& params) {
  AMHEX_RETURN_IF_ERROR(Validate(params));
  AMHEX_RETURN_IF_ERROR(CheckInput(hull));
  double volume = 0;
  int64_t element_count = 0;
  if (const auto* cells = std::get_if<VolumeMesh>(&hull)) {
    element_count = static_cast<int64_t>(cells->cell_faces.size());
    volume = kTypicalFill * BoxVolume(BoxOf(cells->vertices));
  } else if (const auto* mesh = std::get_if<TriangleMesh>(&hull)) {
    volume = VolumeGuess(*mesh);
    element_count = static_cast<int64_t>(mesh->triangles.size());
  } else {
    const PointCloud& cloud = std::get<PointCloud>(hull);
    const std::optional<PointCloud> without_strays = DropStrays(cloud);
    const PointCloud& body = without_strays.has_value() ? *without_strays : cloud;
    volume = kTypicalFill * BoxVolume(BoxOf(body.points));
    element_count = static_cast<int64_t>(cloud.points.size());
  }
  const auto* given = std::get_if<VolumeMesh>(&hull);
  const bool is_meshed = given == nullptr || params.input.volume_use == VolumeUse::kHull;
  const double cells = is_meshed ? WantedCells(params.sizing, volume)
                                 : CellsFromVolume(*given, params.input.volume_use);
  if (!(cells <= static_cast<double>(kMaxCellCount))) {
    return absl::OutOfRangeError(absl::StrCat("the input makes about ", cells,
                                              " cells of edge length ", params.sizing.edge_length,
                                              ", the limit is ", kMaxCellCount));
  }
  CostEstimate estimate;
  estimate.cell_count = std::max<int64_t>(1, std::llround(cells));
  const int64_t most_cells =
      is_meshed ? MostCells(params.sizing, estimate.cell_count) : estimate.cell_count;
  estimate.memory_bytes = ExpectedMemoryBytes(most_cells, element_count);
  estimate.seconds = is_meshed ? SecondsOfHull(estimate.cell_count, params, element_count)
                               : kSecondsPerGivenCell * static_cast<double>(estimate.cell_count);
  if (is_meshed && params.run.backend != Backend::kCpu) {
    estimate.device_memory_bytes = DeviceBytes(most_cells, element_count, params);
  }
  // Under kAuto the CPU takes what the device has no room for.
  if (params.run.backend == Backend::kCuda) AMHEX_RETURN_IF_ERROR(CheckDeviceMemory(estimate));
  const int64_t limit = params.run.memory_limit_bytes;
  if (limit > 0 && estimate.memory_bytes > limit) {
    return absl::ResourceExhaustedError(absl::StrCat("about ", estimate.memory_bytes,
                                                     " bytes are needed for ", most_cells,
                                                     " cells, run.memory_limit_bytes is ", limit));
  }
  return estimate;
}

CostEstimate PredictCost(const MeshingParams& params, int64_t input_element_count) {
  const SizingParams& sizing = params.sizing;
  const bool is_told = sizing.cell_count > 0 || sizing.edge_length <= 0;
  const int64_t cells = sizing.cell_count > 0 ? sizing.cell_count : kDefaultCellCount;
  CostEstimate estimate;
  estimate.seconds = SecondsOfHull(cells, params, input_element_count);
  if (!is_told) return estimate;
  estimate.cell_count = cells;
  estimate.memory_bytes = ExpectedMemoryBytes(MostCells(sizing, cells), input_element_count);
  return estimate;
}

}  // namespace amhex
