// The parts of `amhex mesh` one by one, for jobs that outlive a terminal: submit, watch, fetch.
#include <cstdio>
#include <memory>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "cli/commands.h"
#include "cli/exit_codes.h"
#include "cli/load_guidance.h"
#include "cli/load_input.h"
#include "cli/progress_display.h"
#include "cli/shared_flags.h"
#include "cli/signals.h"

namespace amhex::client {
namespace {

namespace v1 = amhex::v1;

struct SubmitFlags {
  std::string input, request_id;
  ServerChoice server;
  ParameterFlags parameters;
  GuidanceFlags guidance;
};

int RunSubmit(const SubmitFlags& flags, const v1::MeshingParams& params) {
  Interrupt interrupt;
  const SignalWatcher signals(&interrupt);
  absl::StatusOr<Guidance> guidance = LoadGuidance(flags.guidance);
  if (!guidance.ok()) return Fail(guidance.status(), kExitInput);
  const absl::StatusOr<LoadedInput> input =
      LoadInput(flags.input, params.sizing(), *std::move(guidance));
  if (!input.ok()) return Fail(input.status(), kExitInput);
  const absl::StatusOr<Connection> connection = Connect(flags.server, &interrupt);
  if (!connection.ok()) return Fail(connection.status());
  ProgressDisplay display(ProgressDisplay::StyleOfStderr());
  SubmitOptions options;
  options.request_id = flags.request_id;
  options.priority = flags.parameters.priority;
  options.run_timeout = absl::Seconds(flags.parameters.time_limit_seconds);
  options.on_upload = [&display](int64_t done, int64_t total) {
    display.OnTransfer("uploading", done, total);
  };
  const absl::StatusOr<v1::Job> job = connection->client->Submit(input->encoded, params, options);
  display.Clear();
  if (!job.ok()) return Fail(job.status());
  std::printf("%s\n", job->name().c_str());
  return kExitSuccess;
}

struct JobFlags {
  std::string name;
  ServerChoice server;
  OutputFlags outputs;
};

int RunWatch(const JobFlags& flags) {
  Interrupt interrupt;
  const SignalWatcher signals(&interrupt);
  const absl::StatusOr<Connection> connection = Connect(flags.server, &interrupt);
  if (!connection.ok()) return Fail(connection.status());
  ProgressDisplay display(ProgressDisplay::StyleOfStderr());
  WatchOptions options;
  options.on_frame = [&display](const v1::WatchJobResponse& frame) { display.OnFrame(frame); };
  options.on_reconnect = [&display](const absl::Status& status) { display.OnReconnect(status); };
  const absl::StatusOr<v1::Job> job = connection->client->Watch(flags.name, options);
  display.Clear();
  if (!job.ok()) return Fail(job.status());
  if (job->state() != v1::Job::SUCCEEDED) return Fail(ErrorOf(*job));
  std::printf("%s: %s", job->name().c_str(), SummaryOf(*job).c_str());
  return kExitSuccess;
}

int RunFetch(const JobFlags& flags) {
  if (const absl::Status status = CheckOutputs(flags.outputs); !status.ok()) {
    return Fail(status, absl::IsInvalidArgument(status) ? kExitUsage : kExitOutput);
  }
  Interrupt interrupt;
  const SignalWatcher signals(&interrupt);
  const absl::Time begin = absl::Now();
  const absl::StatusOr<Connection> connection = Connect(flags.server, &interrupt);
  if (!connection.ok()) return Fail(connection.status());
  const absl::StatusOr<v1::Job> job = connection->client->GetJob(flags.name);
  if (!job.ok()) return Fail(job.status());
  if (job->has_error()) return Fail(ErrorOf(*job));
  if (!job->has_result()) {
    return Fail(absl::FailedPreconditionError(
        absl::StrCat(job->name(), " is not done yet; amhex watch follows it")));
  }
  ProgressDisplay display(ProgressDisplay::StyleOfStderr());
  absl::StatusOr<AtMostHexaMesh> mesh = connection->client->FetchMesh(
      job->result(),
      [&display](int64_t done, int64_t total) { display.OnTransfer("downloading", done, total); });
  display.Clear();
  if (!mesh.ok()) return Fail(mesh.status());
  const int code = WriteOutputs(flags.outputs, *job, *std::move(mesh));
  if (code != kExitSuccess) return code;
  const absl::Status written =
      WriteJson(flags.outputs, *job, InputNote(), absl::ToDoubleSeconds(absl::Now() - begin));
  return written.ok() ? kExitSuccess : Fail(written, kExitOutput);
}

}  // namespace

void AddSubmitCommand(CLI::App* app, int* exit_code) {
  auto flags = std::make_shared<SubmitFlags>();
  CLI::App* command = app->add_subcommand("submit", "Hand a job in and print its name");
  command->add_option("input", flags->input, kScanHelp)->type_name("FILE")->required();
  command
      ->add_option("--request-id", flags->request_id,
                   "Makes the command repeatable: the same one gives the same job")
      ->type_name("UUID");
  AddParameterFlags(command, &flags->parameters);
  AddGuidanceFlags(command, &flags->guidance);
  AddServerFlags(command, LocalServers::kForbidden, &flags->server);
  command->footer(
      "Examples:\n"
      "  amhex submit part.stl --cells 10000 --server mesher:50051\n"
      "  export AMHEX_SERVER=mesher:50051; job=$(amhex submit part.stl); amhex watch $job");
  command->callback([flags, command, exit_code] {
    *exit_code = RunSubmit(*flags, ParamsFrom(*command, flags->parameters));
  });
}

void AddWatchCommand(CLI::App* app, int* exit_code) {
  auto flags = std::make_shared<JobFlags>();
  CLI::App* command =
      app->add_subcommand("watch", "Follow a job to its end; Ctrl-C leaves it running");
  command->add_option("job", flags->name, kJobHelp)->type_name("NAME")->required();
  AddServerFlags(command, LocalServers::kForbidden, &flags->server);
  command->footer("Example:\n  amhex watch JOB --server mesher:50051");
  command->callback([flags, exit_code] { *exit_code = RunWatch(*flags); });
}

void AddFetchCommand(CLI::App* app, int* exit_code) {
  auto flags = std::make_shared<JobFlags>();
  CLI::App* command = app->add_subcommand("fetch", "Write the mesh of a job that is done");
  command->add_option("job", flags->name, kJobHelp)->type_name("NAME")->required();
  AddOutputFlags(command, &flags->outputs);
  command->add_option("--input", flags->outputs.input, kInputHelp)->type_name("FILE");
  AddServerFlags(command, LocalServers::kForbidden, &flags->server);
  command->footer(
      "Examples:\n"
      "  amhex fetch JOB --server mesher:50051 -o part.vtu\n"
      "  amhex fetch JOB --server mesher:50051 -o part.vtu --report part.html --input part.stl");
  command->callback([flags, exit_code] { *exit_code = RunFetch(*flags); });
}

}  // namespace amhex::client
