#include "cli/shared_flags.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "cells/solver_ready.h"
#include "cli/exit_codes.h"
#include "cli/help.h"
#include "distance/hull_distance.h"
#include "formats/hull_writer.h"
#include "formats/mesh_file.h"
#include "formats/status_macros.h"
#include "page/report_page.h"

namespace amhex::client {
namespace {

namespace v1 = amhex::v1;

constexpr double kMostPatienceSeconds = 86400;  // a day
constexpr double kMostPriority = 100;           // SubmitJobRequest.priority

bool Given(const CLI::App& command, const char* flag) { return command.count(flag) > 0; }

absl::Status CheckFolderOf(const std::string& path) {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  if (folder.empty() || std::filesystem::is_directory(folder, error)) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat(path, ": the folder ", folder.string(), " does not exist"));
}

void SetRelaxation(const CLI::App& command, const ParameterFlags& flags,
                   v1::MeshingParams* params) {
  constexpr std::array<std::pair<std::string_view, v1::Initialization>, 3> kInitializations = {
      {{"field", v1::INITIALIZATION_FIELD},
       {"grid", v1::INITIALIZATION_GRID},
       {"jittered_grid", v1::INITIALIZATION_JITTERED_GRID}}};
  const bool given = Given(command, "--initialization");
  for (const auto& [word, value] : kInitializations) {
    if (given && flags.initialization == word)
      params->mutable_relaxation()->set_initialization(value);
  }
  if (Given(command, "--iterations")) {
    params->mutable_relaxation()->set_iteration_count(flags.iterations);
  }
  if (Given(command, "--lattice-points")) {
    params->mutable_relaxation()->set_lattice_points_per_site(flags.lattice_points);
  }
  if (Given(command, "--regularity-weight")) {
    params->mutable_relaxation()->set_regularity_weight(flags.regularity_weight);
  }
  if (Given(command, "--split-limit")) {
    params->mutable_relaxation()->set_split_limit(flags.split_limit);
  }
  if (Given(command, "--jitter")) params->mutable_relaxation()->set_jitter(flags.jitter);
}

void AddSecurityFlags(CLI::App* command, ServerChoice* choice) {
  command->add_flag("--tls", choice->tls, "Protect the connection with TLS")->envname("AMHEX_TLS");
  command
      ->add_option("--tls-ca", choice->authorities,
                   "PEM file of who may vouch for the server; implies --tls; by default the "
                   "system's authorities")
      ->type_name("FILE")
      ->envname("AMHEX_TLS_CA");
  auto* certificate =
      command->add_option("--tls-cert", choice->certificate,
                          "PEM file of your own certificate, together with --tls-key");
  certificate->type_name("FILE")->envname("AMHEX_TLS_CERT");
  auto* key = command->add_option("--tls-key", choice->key, "PEM file of your certificate's key");
  key->type_name("FILE")->envname("AMHEX_TLS_KEY")->needs(certificate);
  certificate->needs(key);
  command
      ->add_option("--tls-name", choice->server_name,
                   "Name in the server's certificate, if not that of its address")
      ->type_name("NAME");
  command->add_option("--token-file", choice->token_file, "File that holds your token")
      ->type_name("FILE")
      ->envname("AMHEX_TOKEN_FILE");
}

void SetVolumeUse(const CLI::App& command, const ParameterFlags& flags, v1::MeshingParams* params) {
  if (!Given(command, "--volume-use")) return;
  constexpr std::array<std::pair<std::string_view, v1::VolumeUse>, 3> kUses = {
      {{"reassemble", v1::VOLUME_USE_REASSEMBLE},
       {"hull", v1::VOLUME_USE_HULL},
       {"subdivide", v1::VOLUME_USE_SUBDIVIDE}}};
  for (const auto& [word, value] : kUses) {
    if (flags.volume_use == word) params->mutable_input()->set_volume_use(value);
  }
}

}  // namespace

void AddServerFlags(CLI::App* command, LocalServers local_servers, ServerChoice* choice) {
  command->option_defaults()->group(kServerGroup);
  auto* server =
      command->add_option("--server", choice->address, "Server's address, host:port or unix:/path");
  server->type_name("ADDRESS")->envname("AMHEX_SERVER");
  if (local_servers == LocalServers::kAllowed) {
    // An address from the environment does not count against --local.
    command->add_flag("--local", choice->local,
                      "Start a private server for this command; the default without a server");
  } else {
    server->required();
  }
  command
      ->add_option("--patience", choice->patience_seconds,
                   "How long to keep trying while the server cannot be reached")
      ->check(Within(0, kMostPatienceSeconds))
      ->type_name("SECONDS")
      ->capture_default_str();
  AddSecurityFlags(command, choice);
}

namespace {

void AddRelaxationFlags(CLI::App* command, ParameterFlags* flags) {
  command->option_defaults()->group(kRelaxationGroup);
  command->add_option("--initialization", flags->initialization, "Where sites come from")
      ->check(CLI::IsMember({"field", "grid", "jittered_grid"}))
      ->type_name("")
      ->capture_default_str();
  command
      ->add_option("--iterations", flags->iterations,
                   "Iterations of the relaxation; by default 0 from fields, 150 from grids")
      ->type_name("N");
  command
      ->add_option("--lattice-points", flags->lattice_points,
                   "Lattice points per site of the Voronoi labelling")
      ->type_name("N")
      ->capture_default_str();
  command
      ->add_option("--regularity-weight", flags->regularity_weight,
                   "Peak of the pull towards regular cells")
      ->type_name("W")
      ->capture_default_str();
  command
      ->add_option("--split-limit", flags->split_limit, "Neighbours from which on a site is split")
      ->type_name("N")
      ->capture_default_str();
  command
      ->add_option("--jitter", flags->jitter,
                   "Displacement of the sites of a jittered grid, in edge lengths")
      ->type_name("X")
      ->capture_default_str();
  command
      ->add_option("--extraction", flags->extraction,
                   "How cells are found: from merged cubes first, or by the paper's search alone")
      ->check(CLI::IsMember({"direct", "paper"}))
      ->type_name("")
      ->capture_default_str();
  command
      ->add_option("--min-quality", flags->min_quality,
                   "Least scaled Jacobian of cells that the assembly takes")
      ->type_name("Q")
      ->capture_default_str();
}

void AddJobFlags(CLI::App* command, ParameterFlags* flags) {
  command->option_defaults()->group(kJobGroup);
  command->add_option("--backend", flags->backend, "Where to compute")
      ->check(CLI::IsMember({"auto", "cpu", "cuda"}))
      ->type_name("")
      ->capture_default_str();
  command->add_option("--threads", flags->threads, "Threads to use; by default all cores")
      ->type_name("N");
  command
      ->add_option("--memory-limit", flags->memory_limit_bytes,
                   "Most memory that the engine may use; by default the server's limit")
      ->type_name("BYTES");
  command
      ->add_option("--time-limit", flags->time_limit_seconds,
                   "Longest that the job may run; by default the server's limit")
      ->check(AboveZero())
      ->type_name("SECONDS");
  command
      ->add_option("--priority", flags->priority, "Place in the queue, 0 to 100; lower is sooner")
      ->check(Within(0, kMostPriority))
      ->type_name("N")
      ->capture_default_str();
}

}  // namespace

void AddParameterFlags(CLI::App* command, ParameterFlags* flags) {
  command->option_defaults()->group(kSizeGroup);
  auto* cells = command->add_option("--cells", flags->cells, "Wanted number of cells");
  cells->check(AboveZero())->type_name("N");
  command->add_option("--edge-length", flags->edge_length, "Wanted edge length, in model units")
      ->check(AboveZero())
      ->type_name("LENGTH")
      ->excludes(cells);
  command
      ->add_option("--trials", flags->trials,
                   "Lattices to try, of slightly different density; by default as many as pay")
      ->type_name("N");
  command->option_defaults()->group(kMeshingGroup);
  command
      ->add_option("--sharp-angle", flags->sharp_angle,
                   "Angle from which on an edge of the input is kept sharp")
      ->type_name("DEGREES")
      ->capture_default_str();
  command
      ->add_option("--volume-use", flags->volume_use,
                   "What to do with a volume mesh: reassemble its cells, mesh its hull, subdivide")
      ->check(CLI::IsMember({"reassemble", "hull", "subdivide"}))
      ->type_name("")
      ->capture_default_str();
  command
      ->add_option("--seed", flags->seed,
                   "Seed of what is random: how far the sites of a jittered grid are moved")
      ->type_name("N")
      ->capture_default_str();
  AddRelaxationFlags(command, flags);
  AddJobFlags(command, flags);
}

v1::MeshingParams ParamsFrom(const CLI::App& command, const ParameterFlags& flags) {
  v1::MeshingParams params;
  if (Given(command, "--cells")) params.mutable_sizing()->set_cell_count(flags.cells);
  if (Given(command, "--edge-length")) {
    params.mutable_sizing()->set_edge_length(flags.edge_length);
  }
  if (Given(command, "--trials")) params.mutable_sizing()->set_trial_count(flags.trials);
  if (Given(command, "--sharp-angle")) {
    params.mutable_input()->set_sharp_angle_degrees(flags.sharp_angle);
  }
  SetVolumeUse(command, flags, &params);
  SetRelaxation(command, flags, &params);
  if (Given(command, "--min-quality")) {
    params.mutable_assembly()->set_min_quality(flags.min_quality);
  }
  if (Given(command, "--extraction")) {
    params.mutable_assembly()->set_extraction(flags.extraction == "paper" ? v1::EXTRACTION_PAPER
                                                                          : v1::EXTRACTION_DIRECT);
  }
  if (Given(command, "--backend")) {
    params.mutable_run()->set_backend(flags.backend == "cpu"    ? v1::BACKEND_CPU
                                      : flags.backend == "cuda" ? v1::BACKEND_CUDA
                                                                : v1::BACKEND_AUTO);
  }
  if (Given(command, "--threads")) params.mutable_run()->set_thread_count(flags.threads);
  if (Given(command, "--seed")) params.mutable_run()->set_seed(flags.seed);
  if (Given(command, "--memory-limit")) {
    params.mutable_run()->set_memory_limit_bytes(flags.memory_limit_bytes);
  }
  return params;
}

void AddOutputFlags(CLI::App* command, OutputFlags* flags) {
  command->option_defaults()->group(kOutputGroup);
  command
      ->add_option("-o,--output", flags->output, absl::StrCat("Mesh file: ", kMeshOutputExtensions))
      ->type_name("FILE")
      ->required();
  command->add_flag("--solver-ready", flags->solver_ready, kSolverReadyHelp);
  command->add_option("--json", flags->json, "Statistics, timings, parameters and warnings")
      ->type_name("FILE");
  command
      ->add_option("--report", flags->report,
                   "HTML page that shows the mesh and its figures in a browser")
      ->type_name("FILE");
  command->add_option("--picture", flags->picture, "PNG of the mesh, cut open")->type_name("FILE");
  AddPictureFlags(command, &flags->look);
}

void AddPictureFlags(CLI::App* command, PictureFlags* flags) {
  command
      ->add_option("--cut", flags->cut,
                   "Where to cut the picture's mesh: x, y or z, or as in y:0.3, or none; by "
                   "default across its shortest side")
      ->type_name("WHERE");
  command
      ->add_option("--colour,--color", flags->colour,
                   "What the picture's colours say: the cells' type, their scaled Jacobian, or "
                   "their distance to the input")
      ->check(CLI::IsMember({"type", "quality", "distance"}))
      ->type_name("")
      ->capture_default_str();
  command->add_option("--size", flags->size, "The picture's size in pixels")
      ->type_name("WxH")
      ->capture_default_str();
}

absl::Status CheckOutputs(const OutputFlags& flags) {
  if (!IsWritableMeshPath(flags.output)) {
    return absl::InvalidArgumentError(absl::StrCat(
        flags.output, ": unknown extension; meshes are written to ", kMeshOutputExtensions));
  }
  for (const std::string& path : {flags.output, flags.json, flags.report, flags.picture}) {
    if (!path.empty()) AMHEX_RETURN_IF_ERROR(CheckFolderOf(path));
  }
  if (!flags.picture.empty()) AMHEX_RETURN_IF_ERROR(CheckPngPath(flags.picture));
  if (flags.look.colour == "distance" && flags.input.empty()) {
    return absl::InvalidArgumentError("--colour distance wants to know the input: --input FILE");
  }
  return PictureOptionsFrom(flags.look, AtMostHexaMesh()).status();
}

absl::StatusOr<PictureOptions> PictureOptionsFrom(const PictureFlags& flags,
                                                  const AtMostHexaMesh& mesh) {
  PictureOptions options;
  if (const absl::Status status = ParseSize(flags.size, &options); !status.ok()) return status;
  if (flags.colour == "quality") options.colouring = Colouring::kQuality;
  if (flags.colour == "distance") options.colouring = Colouring::kDistance;
  if (flags.cut == "none") return options;
  if (flags.cut.empty()) {
    options.cut = DefaultCut(mesh);
    return options;
  }
  AMHEX_ASSIGN_OR_RETURN(options.cut, ParseCut(flags.cut));
  return options;
}

absl::Status DivideForSolvers(MeshDocument* document) {
  const size_t cells_before = document->mesh.corners.size();
  absl::StatusOr<AtMostHexaMesh> divided = MakeSolverReady(document->mesh);
  if (!divided.ok()) return divided.status();
  document->mesh = *std::move(divided);
  const std::vector<float>& quality = document->mesh.quality;
  const double least = *std::min_element(quality.begin(), quality.end());
  document->facts.push_back({"solver_ready.cell_count_before", static_cast<double>(cells_before)});
  document->facts.push_back(
      {"solver_ready.cell_count", static_cast<double>(document->mesh.corners.size())});
  document->facts.push_back({"solver_ready.min_scaled_jacobian", least});
  return absl::OkStatus();
}

std::string DescribeDivision(const MeshDocument& document) {
  std::map<std::string, double> numbers;
  for (const MeshFact& fact : document.facts) {
    if (const auto* number = std::get_if<double>(&fact.value)) numbers[fact.name] = *number;
  }
  return absl::StrFormat("solver-ready: %.0f cells became %.0f, least scaled Jacobian %.3f",
                         numbers["solver_ready.cell_count_before"],
                         numbers["solver_ready.cell_count"],
                         numbers["solver_ready.min_scaled_jacobian"]);
}

absl::Status MeasureDistances(const std::string& input, MeshDocument* document) {
  if (input.empty()) return absl::OkStatus();
  absl::StatusOr<std::vector<float>> distances = DistancesToFile(document->mesh, input);
  if (!distances.ok()) return distances.status();
  document->distances = *std::move(distances);
  return absl::OkStatus();
}

int WriteOutputs(const OutputFlags& flags, const v1::Job& job, AtMostHexaMesh mesh,
                 const OutputExtras& extras) {
  MeshDocument document{std::move(mesh), FactsOfJob(job)};
  document.facts.insert(document.facts.end(), extras.facts.begin(), extras.facts.end());
  absl::Status status;
  if (flags.solver_ready) status = DivideForSolvers(&document);
  if (!status.ok()) return Fail(status, kExitOutput);
  if (const absl::Status measured = MeasureDistances(flags.input, &document); !measured.ok()) {
    return Fail(measured, kExitInput);
  }
  status = WriteMeshFile(document, flags.output);
  if (!status.ok()) return Fail(status, kExitOutput);
  if (extras.print_summary) {
    std::printf("%s: %s", flags.output.c_str(), SummaryOf(job).c_str());
    if (flags.solver_ready) std::printf("  %s\n", DescribeDivision(document).c_str());
  }
  if (!flags.report.empty()) {
    const absl::StatusOr<std::string> page =
        FormatReportPage(document, std::filesystem::path(flags.output).filename().string());
    status = page.ok() ? WriteWholeFile(flags.report, *page) : page.status();
    if (!status.ok()) return Fail(status, kExitOutput);
  }
  if (flags.picture.empty()) return kExitSuccess;
  return WritePicture(document, flags.look, flags.picture);
}

int WritePicture(const MeshDocument& document, const PictureFlags& flags, const std::string& path) {
  if (const absl::Status status = CheckPngPath(path); !status.ok()) return Fail(status, kExitUsage);
  absl::StatusOr<PictureOptions> options = PictureOptionsFrom(flags, document.mesh);
  if (!options.ok()) return Fail(options.status(), kExitUsage);
  options->distances = document.distances;
  const absl::StatusOr<Image> image = DrawMesh(document.mesh, *options);
  if (!image.ok()) return Fail(image.status(), kExitInput);
  const absl::Status status = WritePng(*image, path);
  return status.ok() ? kExitSuccess : Fail(status, kExitOutput);
}

absl::Status WriteJson(const OutputFlags& flags, const v1::Job& job, const InputNote& input,
                       double seconds) {
  if (flags.json.empty()) return absl::OkStatus();
  return WriteWholeFile(flags.json, JsonOf(job, input, seconds));
}

}  // namespace amhex::client
