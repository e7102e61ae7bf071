// Flags that several subcommands have.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "amhex/v1/job.pb.h"
#include "amhex/v1/params.pb.h"
#include "amhex/volume_mesh.h"
#include "cli/connection.h"
#include "cli/report.h"
#include "picture/mesh_picture.h"

namespace amhex::client {

// --server, --local (where `may_be_local`), --patience.
enum class LocalServers { kForbidden, kAllowed };
void AddServerFlags(CLI::App* command, LocalServers local_servers, ServerChoice* choice);

// Every meshing parameter that a user may want to set.
struct ParameterFlags {
  int64_t cells = 0;
  double edge_length = 0;
  std::string backend, initialization, extraction, volume_use;
  int iterations = -1, lattice_points = 108, split_limit = 10;
  double regularity_weight = 1, jitter = 0.2;
  double sharp_angle = 35, min_quality = 0.25, time_limit_seconds = 0;
  int threads = 0, priority = 50;
  int64_t seed = 1, memory_limit_bytes = 0;
};
void AddParameterFlags(CLI::App* command, ParameterFlags* flags);
// Only what was given on the command line is set; the rest is the server's default.
amhex::v1::MeshingParams ParamsFrom(const CLI::App& command, const ParameterFlags& flags);

// -o, --solver-ready, --json, --report, --picture, --cut, --size.
struct OutputFlags {
  std::string output, json, report, picture, cut, size;
  std::string input;  // the file that the mesh's distances are measured to; empty = none
  bool solver_ready = false;
};
void AddOutputFlags(CLI::App* command, OutputFlags* flags);
// Refuses early what could not be written later: unknown extensions, missing folders.
absl::Status CheckOutputs(const OutputFlags& flags);
// Replaces the mesh by one of hexahedra, prisms, pyramids and tetrahedra, adds the facts
// solver_ready.*, which DescribeDivision puts into words.
absl::Status DivideForSolvers(MeshDocument* document);
std::string DescribeDivision(const MeshDocument& document);
inline constexpr const char* kSolverReadyHelp =
    "Divide hexprisms and slices, so that hexahedra, prisms, pyramids and tetrahedra remain";
// Fills in how far each cell on the hull is from the input in that file; nothing without a path.
absl::Status MeasureDistances(const std::string& input, MeshDocument* document);
inline constexpr const char* kInputHelp =
    "What was meshed, to measure how far each cell on the hull is from it";
struct OutputExtras {
  bool print_summary = true;
  std::vector<MeshFact> facts;  // beside those of the job
};
// Writes mesh, report and picture and prints the summary.
int WriteOutputs(const OutputFlags& flags, const amhex::v1::Job& job, AtMostHexaMesh mesh,
                 const OutputExtras& extras = {});
// Writes the JSON file if one is wanted.
absl::Status WriteJson(const OutputFlags& flags, const amhex::v1::Job& job, const InputNote& input,
                       double seconds);

// The options of a picture from --cut and --size; `default_cut` stands for an empty --cut.
absl::StatusOr<PictureOptions> PictureOptionsFrom(const std::string& cut, const std::string& size,
                                                  const AtMostHexaMesh& mesh);

}  // namespace amhex::client
