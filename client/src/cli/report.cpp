#include "cli/report.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "amhex/client.h"
#include "cells/cells.h"
#include "cli/json.h"
#include "cli/progress_display.h"

namespace amhex::client {
namespace {

namespace v1 = amhex::v1;

double Seconds(const google::protobuf::Duration& duration) {
  return static_cast<double>(duration.seconds()) + 1e-9 * duration.nanos();
}

double WallSeconds(const v1::Job& job) {
  double sum = 0;
  for (const v1::StageReport& stage : job.stages()) sum += Seconds(stage.wall_duration());
  return sum;
}

// The lines inside a JSON object, moved in by two.
std::string Lines(const google::protobuf::Message& message) { return ToJson(message, 2); }

}  // namespace

std::string SummaryOf(const v1::Job& job) {
  const v1::MeshingResult& result = job.result();
  const v1::MeshStatistics& s = result.statistics();
  std::string text = absl::StrCat(s.cell_count(), " cells, ", s.vertex_count(), " vertices\n");
  for (const v1::CellTypeCount& count : s.cells_by_type()) {
    const auto type = static_cast<PrimitiveType>(count.type());
    absl::StrAppendFormat(
        &text, "  %-12s %8d  %5.1f %%", PrimitiveName(type), count.cell_count(),
        100.0 * static_cast<double>(count.cell_count()) / static_cast<double>(s.cell_count()));
    if (type == PrimitiveType::kHexahedron) {
      absl::StrAppendFormat(&text, ", %.1f %% by volume", 100 * s.hexahedra_volume_ratio());
    }
    text += "\n";
  }
  absl::StrAppendFormat(&text, "  scaled Jacobian  least %.3f, average %.3f\n",
                        s.min_scaled_jacobian(), s.average_scaled_jacobian());
  absl::StrAppendFormat(
      &text,
      "  distance to the input in %% of its diagonal  mesh to input %.3f at most, "
      "input to mesh %.3f at most, %.4f on average\n",
      100 * s.mesh_to_input_max(), 100 * s.input_to_mesh_max(), 100 * s.input_to_mesh_mean());
  if (s.sharp_edge_deviation_max() > 0) {
    absl::StrAppendFormat(&text,
                          "  sharp edges followed within %.3f edge lengths (rms), %.3f at most\n",
                          s.sharp_edge_deviation_rms(), s.sharp_edge_deviation_max());
  }
  absl::StrAppendFormat(&text,
                        "  edge length %.4g wanted, %.4g at least, volume %.6g of %.6g, genus %d\n",
                        s.edge_length(), s.shortest_edge(), s.volume(), s.hull_volume(), s.genus());
  absl::StrAppendFormat(&text, "  %.2f s, %s\n", WallSeconds(job), result.backend_note());
  for (const std::string& warning : result.warnings()) {
    absl::StrAppend(&text, "  warning: ", warning, "\n");
  }
  return text;
}

std::string JsonOf(const v1::Job& job, const InputNote& input, double seconds) {
  const auto* state = v1::Job::State_descriptor()->FindValueByNumber(job.state());
  std::string text = absl::StrCat(
      "{\n  \"job\": ", JsonString(job.name()),
      ",\n  \"state\": ", JsonString(state != nullptr ? EnumWord(*state) : "unknown"),
      ",\n  \"input\": {\n    \"path\": ", JsonString(input.path),
      ",\n    \"description\": ", JsonString(input.description),
      ",\n    \"encoding\": ", JsonString(input.encoding),
      "\n  },\n  \"seconds\": ", absl::StrFormat("%.6f", seconds), ",\n  \"stages\": [");
  for (int i = 0; i < job.stages_size(); ++i) {
    absl::StrAppend(&text, i == 0 ? "\n    " : ",\n    ", ToJson(job.stages(i), 4));
  }
  text += job.stages_size() == 0 ? "]" : "\n  ]";
  if (job.has_result()) {
    const v1::MeshingResult& result = job.result();
    absl::StrAppend(&text, ",\n  \"statistics\": ", Lines(result.statistics()),
                    ",\n  \"parameters\": ", Lines(result.effective_params()),
                    ",\n  \"mesh_sha256\": ", JsonString(result.mesh().sha256()),
                    ",\n  \"engine_version\": ", JsonString(result.engine_version()),
                    ",\n  \"backend_note\": ", JsonString(result.backend_note()),
                    ",\n  \"warnings\": [");
    text += absl::StrJoin(result.warnings(), ", ",
                          [](std::string* out, const std::string& w) { *out += JsonString(w); });
    text += "]";
  }
  if (job.has_error()) {
    const absl::Status error = ErrorOf(job);
    absl::StrAppend(&text, ",\n  \"error\": {\n    \"code\": ",
                    JsonString(absl::StatusCodeToString(error.code())),
                    ",\n    \"reason\": ", JsonString(ReasonOf(error)),
                    ",\n    \"message\": ", JsonString(std::string(error.message())), "\n  }");
  }
  return text + "\n}\n";
}

std::vector<MeshFact> FactsOfJob(const v1::Job& job) {
  const v1::MeshingResult& result = job.result();
  std::vector<MeshFact> facts = FactsOf("statistics", result.statistics());
  for (const v1::CellTypeCount& count : result.statistics().cells_by_type()) {
    const auto type = static_cast<PrimitiveType>(count.type());
    facts.push_back({absl::StrCat("statistics.cells_by_type.", PrimitiveName(type)),
                     static_cast<double>(count.cell_count())});
  }
  const std::vector<MeshFact> parameters = FactsOf("parameters", result.effective_params());
  facts.insert(facts.end(), parameters.begin(), parameters.end());
  for (const v1::StageReport& stage : job.stages()) {
    const auto* value = v1::Stage_descriptor()->FindValueByNumber(stage.stage());
    facts.push_back({absl::StrCat("timings.", value != nullptr ? EnumWord(*value) : "unknown"),
                     Seconds(stage.wall_duration())});
  }
  facts.push_back({"engine_version", result.engine_version()});
  facts.push_back({"backend_note", result.backend_note()});
  facts.push_back({"warnings", absl::StrJoin(result.warnings(), "\n")});
  return facts;
}

void ConvergenceRecord::OnFrame(const v1::WatchJobResponse& frame) {
  const v1::Progress& progress = frame.progress();
  if (!frame.has_progress() || progress.stage() != v1::STAGE_RELAX || progress.iteration() == 0) {
    return;
  }
  // A new attempt begins anew.
  if (!iterations_.empty() && progress.iteration() < iterations_.back()) {
    iterations_.clear(), movements_.clear();
  }
  if (!iterations_.empty() && progress.iteration() == iterations_.back()) return;
  iterations_.push_back(progress.iteration());
  movements_.push_back(progress.mean_movement());
}

std::vector<MeshFact> ConvergenceRecord::Facts() const {
  if (iterations_.empty()) return {};
  return {{"convergence.iteration", iterations_}, {"convergence.movement", movements_}};
}

}  // namespace amhex::client
