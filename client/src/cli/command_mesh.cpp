// amhex mesh INPUT -o OUTPUT: the whole way from a scan to a mesh file.
#include <cstdio>
#include <memory>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "cli/commands.h"
#include "cli/exit_codes.h"
#include "cli/help.h"
#include "cli/load_guidance.h"
#include "cli/load_input.h"
#include "cli/progress_display.h"
#include "cli/progress_events.h"
#include "cli/report.h"
#include "cli/shared_flags.h"
#include "cli/signals.h"

namespace amhex::client {
namespace {

namespace v1 = amhex::v1;

struct MeshFlags {
  std::string input;
  bool quiet = false, distances = false;
  std::string progress = "auto";
  ServerChoice server;
  ParameterFlags parameters;
  GuidanceFlags guidance;
  OutputFlags outputs;
};

// Tells the server to end the job, with a client that is not interrupted itself.
void CancelAbandonedJob(const ClientOptions& options, const std::string& name) {
  ClientOptions calm = options;
  calm.interrupt = nullptr;
  calm.patience = absl::Seconds(5);
  const absl::StatusOr<v1::Job> job = Client(calm).CancelJob(name);
  if (job.ok()) {
    std::fprintf(stderr, "amhex: %s was cancelled\n", name.c_str());
  } else {
    std::fprintf(stderr, "amhex: %s could not be cancelled and goes on: %s\n", name.c_str(),
                 std::string(job.status().message()).c_str());
  }
}

// One run of the command, step by step; any step may end it.
class MeshRun {
 public:
  MeshRun(const MeshFlags& flags, const v1::MeshingParams& params)
      : flags_(flags),
        params_(params),
        display_(flags.quiet ? ProgressDisplay::Style::kSilent
                             : ProgressDisplay::StyleOfWord(flags.progress)) {}

  // With --progress events the last line on stdout tells the end, whatever it is.
  int Run() {
    const int code = RunSteps();
    if (display_.style() == ProgressDisplay::Style::kEvents) PrintEvent(EndEvent(code, outcome_));
    return code;
  }

 private:
  int RunSteps() {
    if (const absl::Status status = CheckOutputs(flags_.outputs); !status.ok()) {
      return Fail(status, absl::IsInvalidArgument(status) ? kExitUsage : kExitOutput);
    }
    absl::StatusOr<Guidance> guidance = LoadGuidance(flags_.guidance);
    if (!guidance.ok()) return Fail(guidance.status(), kExitInput);
    const absl::StatusOr<LoadedInput> input =
        LoadInput(flags_.input, params_.sizing(), *std::move(guidance));
    if (!input.ok()) return Fail(input.status(), kExitInput);
    display_.Say(absl::StrCat(input->note.path, ": ", input->note.description, "; ",
                              input->note.encoding, "; ", input->encoded.bytes.size(), " bytes"));
    absl::StatusOr<Connection> connection = Connect(flags_.server, &interrupt_);
    if (!connection.ok()) return Fail(connection.status());
    const absl::StatusOr<v1::Job> job = SubmitAndWatch(&*connection, input->encoded);
    display_.Clear();
    if (!job.ok()) return Fail(job.status());
    return Finish(&*connection, *job, input->note);
  }

  absl::StatusOr<v1::Job> SubmitAndWatch(Connection* connection, const EncodedInput& input) {
    SubmitOptions submit;
    submit.priority = flags_.parameters.priority;
    submit.run_timeout = absl::Seconds(flags_.parameters.time_limit_seconds);
    submit.on_upload = [this](int64_t done, int64_t total) {
      display_.OnTransfer("uploading", done, total);
    };
    absl::StatusOr<v1::Job> submitted = connection->client->Submit(input, params_, submit);
    if (!submitted.ok()) return submitted;
    if (connection->local_server == nullptr) display_.Say(submitted->name());
    WatchOptions watch;
    watch.on_frame = [this](const v1::WatchJobResponse& frame) {
      convergence_.OnFrame(frame);
      display_.OnFrame(frame);
    };
    watch.on_reconnect = [this](const absl::Status& status) { display_.OnReconnect(status); };
    absl::StatusOr<v1::Job> watched = connection->client->Watch(submitted->name(), watch);
    if (interrupt_.requested()) {
      display_.Clear();
      CancelAbandonedJob(connection->options, submitted->name());
      return absl::CancelledError("interrupted");
    }
    return watched;
  }

  int Finish(Connection* connection, const v1::Job& job, const InputNote& note) {
    const double seconds = absl::ToDoubleSeconds(absl::Now() - begin_);
    outcome_ = JsonOf(job, note, seconds);
    if (job.state() != v1::Job::SUCCEEDED) {
      const absl::Status written = WriteJson(flags_.outputs, job, note, seconds);
      if (!written.ok()) Fail(written);
      return Fail(ErrorOf(job));
    }
    absl::StatusOr<AtMostHexaMesh> mesh = connection->client->FetchMesh(
        job.result(),
        [this](int64_t done, int64_t total) { display_.OnTransfer("downloading", done, total); });
    display_.Clear();
    if (!mesh.ok()) return Fail(mesh.status());
    const std::vector<MeshFact> course = convergence_.Facts();
    const int code = WriteOutputs(flags_.outputs, job, *std::move(mesh),
                                  {display_.style() != ProgressDisplay::Style::kEvents, course});
    if (code != kExitSuccess) return code;
    const absl::Status written =
        WriteJson(flags_.outputs, job, note, absl::ToDoubleSeconds(absl::Now() - begin_));
    return written.ok() ? kExitSuccess : Fail(written, kExitOutput);
  }

  const MeshFlags& flags_;
  const v1::MeshingParams params_;
  const absl::Time begin_ = absl::Now();
  Interrupt interrupt_;
  SignalWatcher signals_{&interrupt_};
  ProgressDisplay display_;
  ConvergenceRecord convergence_;
  std::string outcome_;
};

}  // namespace

void AddMeshCommand(CLI::App* app, int* exit_code) {
  auto flags = std::make_shared<MeshFlags>();
  CLI::App* command =
      app->add_subcommand("mesh", "Turn a scan, surface or volume mesh into an at-most-hexa mesh");
  command->add_option("input", flags->input, kScanHelp)->type_name("FILE")->required();
  AddOutputFlags(command, &flags->outputs);
  command->add_flag("--distances", flags->distances,
                    "Measure how far each cell on the hull is from the input; implied by --report");
  AddParameterFlags(command, &flags->parameters);
  AddGuidanceFlags(command, &flags->guidance);
  AddServerFlags(command, LocalServers::kAllowed, &flags->server);
  command->option_defaults()->group(kProgressGroup);
  command
      ->add_option("--progress", flags->progress,
                   "live, plain, events (JSON lines on stdout) or none; auto = live on a terminal")
      ->check(CLI::IsMember({"auto", "live", "plain", "events", "none"}))
      ->type_name("")
      ->capture_default_str();
  command->add_flag("-q,--quiet", flags->quiet, "No progress");
  command->footer(
      "Examples:\n"
      "  amhex mesh part.stl -o part.vtu\n"
      "  amhex mesh scan.drc --cells 10000 -o scan.vtu --report scan.html --json scan.json\n"
      "  amhex mesh part.obj --edge-length 2.5 --server mesher:50051 -o part.mesh");
  command->callback([flags, command, exit_code] {
    OutputFlags& outputs = flags->outputs;
    if (flags->distances || !outputs.report.empty() || outputs.look.colour == "distance") {
      outputs.input = flags->input;
    }
    *exit_code = MeshRun(*flags, ParamsFrom(*command, flags->parameters)).Run();
  });
}

}  // namespace amhex::client
