// amhex bench: how fast a server is, seen from a client.
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "cli/commands.h"
#include "cli/exit_codes.h"
#include "cli/help.h"
#include "cli/json.h"
#include "cli/load_input.h"
#include "cli/progress_display.h"
#include "cli/shared_flags.h"
#include "cli/signals.h"
#include "formats/hull_writer.h"

namespace amhex::client {
namespace {

namespace v1 = amhex::v1;

constexpr double kMostJobs = 100000, kMostAtOnce = 256;

struct BenchFlags {
  std::string input, json;
  int jobs = 5, at_once = 1;
  ServerChoice server;
  ParameterFlags parameters;
};

double Seconds(const google::protobuf::Duration& duration) {
  return static_cast<double>(duration.seconds()) + 1e-9 * duration.nanos();
}

// What finished jobs cost.
struct Outcome {
  std::vector<double> latencies;        // seconds from submission to the mesh in memory
  std::map<int, double> stage_seconds;  // by Stage, summed over the jobs
  int64_t cell_count = 0;
  absl::Status error;  // of the first job that failed
};

// The value below which `share` of the sorted values lie.
double Percentile(const std::vector<double>& sorted, double share) {
  const auto last = static_cast<double>(sorted.size() - 1);
  return sorted[static_cast<size_t>(share * last + 0.5)];
}

class Bench {
 public:
  Bench(const BenchFlags& flags, const EncodedInput& input, v1::MeshingParams params,
        Client* client)
      : flags_(flags), input_(input), params_(std::move(params)), client_(client) {}

  // Runs all jobs, `at_once` at a time.
  Outcome Run() {
    std::vector<std::thread> threads;
    threads.reserve(static_cast<size_t>(flags_.at_once));
    for (int i = 0; i < flags_.at_once; ++i) threads.emplace_back([this] { Work(); });
    for (std::thread& thread : threads) thread.join();
    std::sort(outcome_.latencies.begin(), outcome_.latencies.end());
    return outcome_;
  }

 private:
  void Work() {
    for (int job = next_++; job < flags_.jobs; job = next_++) {
      const absl::Time begin = absl::Now();
      const absl::StatusOr<v1::Job> done = RunJob(job);
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!done.ok()) {
        if (outcome_.error.ok()) outcome_.error = done.status();
        next_ = flags_.jobs;
        return;
      }
      outcome_.latencies.push_back(absl::ToDoubleSeconds(absl::Now() - begin));
      outcome_.cell_count += done->result().statistics().cell_count();
      for (const v1::StageReport& stage : done->stages()) {
        outcome_.stage_seconds[stage.stage()] += Seconds(stage.wall_duration());
      }
    }
  }

  absl::StatusOr<v1::Job> RunJob(int number) {
    // Each job has a seed of its own, so that no server answers with an earlier result.
    v1::MeshingParams params = params_;
    params.mutable_run()->set_seed(params.run().seed() + number + 1);
    SubmitOptions submit;
    submit.priority = flags_.parameters.priority;
    const absl::StatusOr<v1::Job> submitted = client_->Submit(input_, params, submit);
    if (!submitted.ok()) return submitted.status();
    absl::StatusOr<v1::Job> done = client_->Watch(submitted->name(), {});
    if (!done.ok()) return done.status();
    if (done->state() != v1::Job::SUCCEEDED) return ErrorOf(*done);
    const absl::StatusOr<AtMostHexaMesh> mesh = client_->FetchMesh(done->result());
    if (!mesh.ok()) return mesh.status();
    return done;
  }

  const BenchFlags& flags_;
  const EncodedInput& input_;
  const v1::MeshingParams params_;
  Client* client_;
  std::atomic<int> next_{0};
  std::mutex mutex_;
  Outcome outcome_;
};

std::string JsonOfBench(const BenchFlags& flags, const Outcome& outcome, double seconds) {
  const std::vector<double>& all = outcome.latencies;
  std::string text = absl::StrFormat(
      "{\n  \"input\": %s,\n  \"jobs\": %d,\n  \"at_once\": %d,\n  \"seconds\": %.6f,\n"
      "  \"jobs_per_second\": %.6g,\n  \"cells_per_second\": %.6g,\n  \"latency_seconds\": "
      "{\"least\": %.6f, \"median\": %.6f, \"p95\": %.6f, \"most\": %.6f},\n  \"stages\": {",
      JsonString(flags.input), flags.jobs, flags.at_once, seconds,
      static_cast<double>(all.size()) / seconds, static_cast<double>(outcome.cell_count) / seconds,
      all.front(), Percentile(all, 0.5), Percentile(all, 0.95), all.back());
  bool first = true;
  for (const auto& [stage, sum] : outcome.stage_seconds) {
    const auto* value = v1::Stage_descriptor()->FindValueByNumber(stage);
    absl::StrAppend(&text, first ? "\n    " : ",\n    ",
                    JsonString(value != nullptr ? EnumWord(*value) : "unknown"), ": ",
                    absl::StrFormat("%.6f", sum / static_cast<double>(all.size())));
    first = false;
  }
  return text + "\n  }\n}\n";
}

void PrintBench(const BenchFlags& flags, const Outcome& outcome, double seconds) {
  const std::vector<double>& all = outcome.latencies;
  std::printf("%zu jobs, %d at once, in %.2f s: %.3g jobs and %.4g cells per second\n", all.size(),
              flags.at_once, seconds, static_cast<double>(all.size()) / seconds,
              static_cast<double>(outcome.cell_count) / seconds);
  std::printf("  a job takes %.3f s at least, %.3f s in the median, %.3f s at most\n", all.front(),
              Percentile(all, 0.5), all.back());
  for (const auto& [stage, sum] : outcome.stage_seconds) {
    std::printf("  %-17s %8.3f s on average\n", StageWords(static_cast<v1::Stage>(stage)).c_str(),
                sum / static_cast<double>(all.size()));
  }
}

int RunBench(const BenchFlags& flags, const v1::MeshingParams& params) {
  Interrupt interrupt;
  const SignalWatcher signals(&interrupt);
  const absl::StatusOr<LoadedInput> input = LoadInput(flags.input, params.sizing());
  if (!input.ok()) return Fail(input.status(), kExitInput);
  const absl::StatusOr<Connection> connection = Connect(flags.server, &interrupt);
  if (!connection.ok()) return Fail(connection.status());
  Bench bench(flags, input->encoded, params, connection->client.get());
  const absl::Time begin = absl::Now();
  const Outcome outcome = bench.Run();
  const double seconds = absl::ToDoubleSeconds(absl::Now() - begin);
  if (!outcome.error.ok()) return Fail(outcome.error);
  PrintBench(flags, outcome, seconds);
  if (flags.json.empty()) return kExitSuccess;
  const absl::Status written = WriteWholeFile(flags.json, JsonOfBench(flags, outcome, seconds));
  return written.ok() ? kExitSuccess : Fail(written, kExitOutput);
}

}  // namespace

void AddBenchCommand(CLI::App* app, int* exit_code) {
  auto flags = std::make_shared<BenchFlags>();
  CLI::App* command =
      app->add_subcommand("bench", "Measure a server: the same input again and again");
  command->add_option("input", flags->input, kScanHelp)->type_name("FILE")->required();
  command->add_option("--jobs", flags->jobs, "Jobs to run, each with another seed")
      ->check(Within(1, kMostJobs))
      ->type_name("N")
      ->capture_default_str();
  command->add_option("--at-once", flags->at_once, "Jobs under way at the same time")
      ->check(Within(1, kMostAtOnce))
      ->type_name("N")
      ->capture_default_str();
  command->add_option("--json", flags->json, "The figures as JSON")->type_name("FILE");
  AddParameterFlags(command, &flags->parameters);
  AddServerFlags(command, LocalServers::kAllowed, &flags->server);
  command->footer("Example:\n  amhex bench part.stl --cells 5000 --jobs 20 --at-once 4");
  command->callback([flags, command, exit_code] {
    *exit_code = RunBench(*flags, ParamsFrom(*command, flags->parameters));
  });
}

}  // namespace amhex::client
