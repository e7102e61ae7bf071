#include "convert.h"

#include <string>
#include <utility>

#include "time_convert.h"

namespace amhex::server {
namespace {

namespace pb = amhex::v1;

// Copies an optional proto field into the engine's struct if it is present.
#define AMHEX_COPY_IF_PRESENT(from, to, field) \
  if ((from).has_##field()) (to).field = (from).field()

Backend ToEngine(pb::Backend backend) {
  switch (backend) {
    case pb::BACKEND_CPU:
      return Backend::kCpu;
    case pb::BACKEND_CUDA:
      return Backend::kCuda;
    default:
      return Backend::kAuto;
  }
}

pb::Backend BackendToProto(Backend backend) {
  switch (backend) {
    case Backend::kAuto:
      return pb::BACKEND_AUTO;
    case Backend::kCpu:
      return pb::BACKEND_CPU;
    case Backend::kCuda:
      return pb::BACKEND_CUDA;
  }
  return pb::BACKEND_UNSPECIFIED;
}

Initialization ToEngine(pb::Initialization initialization) {
  switch (initialization) {
    case pb::INITIALIZATION_GRID:
      return Initialization::kGrid;
    case pb::INITIALIZATION_JITTERED_GRID:
      return Initialization::kJitteredGrid;
    default:
      return Initialization::kField;
  }
}

pb::Initialization InitializationToProto(Initialization initialization) {
  switch (initialization) {
    case Initialization::kField:
      return pb::INITIALIZATION_FIELD;
    case Initialization::kGrid:
      return pb::INITIALIZATION_GRID;
    case Initialization::kJitteredGrid:
      return pb::INITIALIZATION_JITTERED_GRID;
  }
  return pb::INITIALIZATION_UNSPECIFIED;
}

Extraction ToEngine(pb::Extraction extraction) {
  return extraction == pb::EXTRACTION_PAPER ? Extraction::kPaper : Extraction::kDirect;
}

pb::Extraction ExtractionToProto(Extraction extraction) {
  switch (extraction) {
    case Extraction::kDirect:
      return pb::EXTRACTION_DIRECT;
    case Extraction::kPaper:
      return pb::EXTRACTION_PAPER;
  }
  return pb::EXTRACTION_UNSPECIFIED;
}

VolumeUse ToEngine(pb::VolumeUse use) {
  switch (use) {
    case pb::VOLUME_USE_HULL:
      return VolumeUse::kHull;
    case pb::VOLUME_USE_SUBDIVIDE:
      return VolumeUse::kSubdivide;
    default:
      return VolumeUse::kReassemble;
  }
}

pb::VolumeUse VolumeUseToProto(VolumeUse use) {
  switch (use) {
    case VolumeUse::kReassemble:
      return pb::VOLUME_USE_REASSEMBLE;
    case VolumeUse::kHull:
      return pb::VOLUME_USE_HULL;
    case VolumeUse::kSubdivide:
      return pb::VOLUME_USE_SUBDIVIDE;
  }
  return pb::VOLUME_USE_UNSPECIFIED;
}

pb::CellType CellTypeToProto(PrimitiveType type) {
  // geometry.proto repeats the paper's numbers.
  return static_cast<pb::CellType>(static_cast<int>(type));
}

void SetCellCounts(const CellCounts& counts,
                   google::protobuf::RepeatedPtrField<pb::CellTypeCount>* out) {
  for (const PrimitiveType type : kPrimitiveTypes) {
    const int64_t count = counts[static_cast<size_t>(type)];
    if (count == 0) continue;
    pb::CellTypeCount& entry = *out->Add();
    entry.set_type(CellTypeToProto(type));
    entry.set_cell_count(count);
  }
}

RelaxationParams ToEngine(const pb::RelaxationParams& params) {
  RelaxationParams out;
  if (params.has_initialization()) out.initialization = ToEngine(params.initialization());
  AMHEX_COPY_IF_PRESENT(params, out, iteration_count);
  AMHEX_COPY_IF_PRESENT(params, out, lattice_points_per_site);
  AMHEX_COPY_IF_PRESENT(params, out, regularity_weight);
  AMHEX_COPY_IF_PRESENT(params, out, split_limit);
  AMHEX_COPY_IF_PRESENT(params, out, jitter);
  return out;
}

RunParams ToEngine(const pb::RunParams& params) {
  RunParams out;
  if (params.has_backend()) out.backend = ToEngine(params.backend());
  AMHEX_COPY_IF_PRESENT(params, out, thread_count);
  if (params.has_seed()) out.seed = static_cast<uint64_t>(params.seed());
  AMHEX_COPY_IF_PRESENT(params, out, memory_limit_bytes);
  return out;
}

}  // namespace

MeshingParams ToEngine(const pb::MeshingParams& params) {
  MeshingParams out;
  AMHEX_COPY_IF_PRESENT(params.sizing(), out.sizing, cell_count);
  AMHEX_COPY_IF_PRESENT(params.sizing(), out.sizing, edge_length);
  AMHEX_COPY_IF_PRESENT(params.sizing(), out.sizing, trial_count);
  AMHEX_COPY_IF_PRESENT(params.input(), out.input, sharp_angle_degrees);
  if (params.input().has_volume_use()) {
    out.input.volume_use = ToEngine(params.input().volume_use());
  }
  out.relaxation = ToEngine(params.relaxation());
  AMHEX_COPY_IF_PRESENT(params.assembly(), out.assembly, min_quality);
  if (params.assembly().has_extraction()) {
    out.assembly.extraction = ToEngine(params.assembly().extraction());
  }
  out.run = ToEngine(params.run());
  return out;
}

pb::MeshingParams ToProto(const MeshingParams& params) {
  pb::MeshingParams out;
  out.mutable_sizing()->set_cell_count(params.sizing.cell_count);
  out.mutable_sizing()->set_edge_length(params.sizing.edge_length);
  out.mutable_sizing()->set_trial_count(params.sizing.trial_count);
  out.mutable_input()->set_sharp_angle_degrees(params.input.sharp_angle_degrees);
  out.mutable_input()->set_volume_use(VolumeUseToProto(params.input.volume_use));
  pb::RelaxationParams& relaxation = *out.mutable_relaxation();
  relaxation.set_initialization(InitializationToProto(params.relaxation.initialization));
  relaxation.set_iteration_count(params.relaxation.iteration_count);
  relaxation.set_lattice_points_per_site(params.relaxation.lattice_points_per_site);
  relaxation.set_regularity_weight(params.relaxation.regularity_weight);
  relaxation.set_split_limit(params.relaxation.split_limit);
  relaxation.set_jitter(params.relaxation.jitter);
  out.mutable_assembly()->set_min_quality(params.assembly.min_quality);
  out.mutable_assembly()->set_extraction(ExtractionToProto(params.assembly.extraction));
  pb::RunParams& run = *out.mutable_run();
  run.set_backend(BackendToProto(params.run.backend));
  run.set_thread_count(params.run.thread_count);
  run.set_seed(static_cast<int64_t>(params.run.seed));
  run.set_memory_limit_bytes(params.run.memory_limit_bytes);
  return out;
}

std::vector<std::pair<std::string, std::string>> UnknownValues(const pb::MeshingParams& params) {
  std::vector<std::pair<std::string, std::string>> unknown;
  if (!pb::VolumeUse_IsValid(params.input().volume_use())) {
    unknown.emplace_back("input.volume_use", "is no known value");
  }
  if (!pb::Initialization_IsValid(params.relaxation().initialization())) {
    unknown.emplace_back("relaxation.initialization", "is no known value");
  }
  if (!pb::Extraction_IsValid(params.assembly().extraction())) {
    unknown.emplace_back("assembly.extraction", "is no known value");
  }
  if (!pb::Backend_IsValid(params.run().backend())) {
    unknown.emplace_back("run.backend", "is no known value");
  }
  if (params.run().seed() < 0) {
    unknown.emplace_back("run.seed", "must be in [0, 9223372036854775807], got " +
                                         std::to_string(params.run().seed()));
  }
  return unknown;
}

pb::Stage ToProto(Stage stage) {
  // The worker's own first stage precedes the engine's, which follow in the same order.
  return static_cast<pb::Stage>(static_cast<int>(stage) + pb::STAGE_CHECK_INPUT);
}

pb::Progress ToProto(const Progress& progress) {
  pb::Progress out;
  out.set_stage(ToProto(progress.stage));
  out.set_stage_fraction(progress.stage_fraction);
  out.set_iteration(progress.iteration);
  out.set_iteration_count(progress.iteration_count);
  out.set_mean_movement(progress.mean_movement);
  out.set_site_count(progress.site_count);
  out.set_cell_count(progress.cell_count);
  out.set_hexahedron_count(progress.cells_by_type[static_cast<size_t>(PrimitiveType::kHexahedron)]);
  SetCellCounts(progress.cells_by_type, out.mutable_cells_by_type());
  out.set_min_scaled_jacobian(progress.min_scaled_jacobian);
  out.set_average_scaled_jacobian(progress.average_scaled_jacobian);
  return out;
}

pb::StageReport ToProto(const StageReport& report) {
  pb::StageReport out;
  out.set_stage(ToProto(report.stage));
  *out.mutable_wall_duration() = ToProto(absl::Seconds(report.wall_seconds));
  if (report.device_seconds > 0) {
    *out.mutable_device_duration() = ToProto(absl::Seconds(report.device_seconds));
  }
  out.set_peak_memory_bytes(report.peak_memory_bytes);
  return out;
}

pb::MeshStatistics ToProto(const MeshStatistics& statistics) {
  pb::MeshStatistics out;
  out.set_cell_count(statistics.cell_count);
  out.set_vertex_count(statistics.vertex_count);
  out.set_boundary_face_count(statistics.boundary_face_count);
  SetCellCounts(statistics.cells_by_type, out.mutable_cells_by_type());
  out.set_hexahedra_ratio(statistics.hexahedra_ratio);
  out.set_hexahedra_volume_ratio(statistics.hexahedra_volume_ratio);
  out.set_min_scaled_jacobian(statistics.min_scaled_jacobian);
  out.set_average_scaled_jacobian(statistics.average_scaled_jacobian);
  out.set_min_scaled_jacobian_hexahedra(statistics.min_scaled_jacobian_hexahedra);
  out.set_average_scaled_jacobian_hexahedra(statistics.average_scaled_jacobian_hexahedra);
  out.set_volume(statistics.volume);
  out.set_hull_volume(statistics.hull_volume);
  out.set_mesh_to_input_max(statistics.mesh_to_input_max);
  out.set_input_to_mesh_max(statistics.input_to_mesh_max);
  out.set_input_to_mesh_mean(statistics.input_to_mesh_mean);
  out.set_edge_length(statistics.edge_length);
  out.set_boundary_component_count(statistics.boundary_component_count);
  out.set_genus(statistics.genus);
  out.set_distance_exceeds_cell(statistics.distance_exceeds_cell);
  out.set_sharp_edge_deviation_rms(statistics.sharp_edge_deviation_rms);
  out.set_sharp_edge_deviation_max(statistics.sharp_edge_deviation_max);
  out.set_shortest_edge(statistics.shortest_edge);
  return out;
}

pb::CostEstimate ToProto(const CostEstimate& estimate) {
  pb::CostEstimate out;
  out.set_cell_count(estimate.cell_count);
  out.set_memory_bytes(estimate.memory_bytes);
  *out.mutable_duration() = ToProto(absl::Seconds(estimate.seconds));
  return out;
}

pb::BackendInfo ToProto(const BackendInfo& info) {
  pb::BackendInfo out;
  out.set_backend(BackendToProto(info.backend));
  out.set_available(info.available);
  out.set_description(info.description);
  return out;
}

pb::MeshingResult ToProto(const MeshingResult& result) {
  pb::MeshingResult out;
  *out.mutable_statistics() = ToProto(result.statistics);
  *out.mutable_effective_params() = ToProto(result.effective_params);
  out.set_engine_version(EngineVersion());
  out.set_backend_note(result.backend_note);
  for (const std::string& warning : result.warnings) out.add_warnings(warning);
  return out;
}

#undef AMHEX_COPY_IF_PRESENT

}  // namespace amhex::server
