// Flags that several subcommands have.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "amhex/params.h"
#include "amhex/v1/job.pb.h"
#include "amhex/v1/params.pb.h"
#include "amhex/volume_mesh.h"
#include "cli/connection.h"
#include "cli/report.h"
#include "picture/mesh_picture.h"

namespace amhex::client {

// --server, --local (where they are allowed), --patience, and what TLS needs.
enum class LocalServers { kForbidden, kAllowed };
void AddServerFlags(CLI::App* command, LocalServers local_servers, ServerChoice* choice);

// What is meshed.
inline constexpr const char* kScanHelp =
    "Scan or surface: .drc .ply .obj .off .stl .xyz; volume mesh: .vtk .msh .vtu .mesh";

inline constexpr const char* kJobHelp = "The job's name, as submit printed it and list shows it";

// Every meshing parameter that a user may want to set. The defaults are the engine's.
struct ParameterFlags {
  int64_t cells = 0;
  double edge_length = 0;
  std::string backend = "auto", initialization = "field", extraction = "direct",
              volume_use = "reassemble";
  int iterations = RelaxationParams().iteration_count;
  int lattice_points = RelaxationParams().lattice_points_per_site;
  int trials = 0;
  int split_limit = RelaxationParams().split_limit;
  double regularity_weight = RelaxationParams().regularity_weight;
  double jitter = RelaxationParams().jitter;
  double sharp_angle = InputParams().sharp_angle_degrees;
  double min_quality = AssemblyParams().min_quality;
  double time_limit_seconds = 0;
  int threads = RunParams().thread_count, priority = 50;
  uint64_t seed = RunParams().seed;
  int64_t memory_limit_bytes = RunParams().memory_limit_bytes;
};
void AddParameterFlags(CLI::App* command, ParameterFlags* flags);
// Only what was given on the command line is set; the rest is the server's default.
amhex::v1::MeshingParams ParamsFrom(const CLI::App& command, const ParameterFlags& flags);

// --cut, --colour, --size.
struct PictureFlags {
  std::string cut, colour = "type", size = "1200x900";
};
void AddPictureFlags(CLI::App* command, PictureFlags* flags);
// INVALID_ARGUMENT for words that say nothing. An empty cut is the largest section of `mesh`.
absl::StatusOr<PictureOptions> PictureOptionsFrom(const PictureFlags& flags,
                                                  const AtMostHexaMesh& mesh);

// Draws and writes it; the exit status.
int WritePicture(const MeshDocument& document, const PictureFlags& flags, const std::string& path);

// -o, --solver-ready, --json, --report, --picture and its flags.
struct OutputFlags {
  std::string output, json, report, picture;
  PictureFlags look;
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

}  // namespace amhex::client
