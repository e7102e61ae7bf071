// Looking after a server: list, cancel, delete, info.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numeric>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "cells/cells.h"
#include "cli/commands.h"
#include "cli/exit_codes.h"
#include "cli/help.h"
#include "cli/json.h"
#include "cli/load_input.h"
#include "cli/progress_display.h"
#include "cli/shared_flags.h"
#include "cli/signals.h"
#include "formats/draco_encoder.h"
#include "formats/hull_reader.h"
#include "formats/volume_reader.h"

namespace amhex::client {
namespace {

namespace v1 = amhex::v1;

constexpr double kMostListed = 100000;

struct ServerFlags {
  ServerChoice server;
  std::string name, file;
  int most = 20;
  bool json = false;
};

std::string StateWord(const v1::Job& job) {
  const auto* value = v1::Job::State_descriptor()->FindValueByNumber(job.state());
  return value != nullptr ? EnumWord(*value) : "unknown";
}

// "40 s ago", "3 h ago": enough to find the job that one means.
std::string AgeOf(const v1::Job& job) {
  const double seconds =
      absl::ToDoubleSeconds(absl::Now() - absl::FromUnixSeconds(job.create_time().seconds()));
  constexpr double kMinute = 60, kHour = 3600, kDay = 86400;
  if (seconds < kMinute) return absl::StrFormat("%.0f s ago", std::max(0.0, seconds));
  if (seconds < kHour) return absl::StrFormat("%.0f min ago", std::floor(seconds / kMinute));
  if (seconds < kDay) return absl::StrFormat("%.0f h ago", std::floor(seconds / kHour));
  return absl::StrFormat("%.0f days ago", std::floor(seconds / kDay));
}

std::string OneLine(const v1::Job& job) {
  std::string details;
  if (job.has_result()) {
    const v1::MeshStatistics& s = job.result().statistics();
    details = absl::StrFormat("%d cells, %.1f %% hexahedra, least scaled Jacobian %.3f",
                              s.cell_count(), 100 * s.hexahedra_ratio(), s.min_scaled_jacobian());
  } else if (job.has_error()) {
    details = job.error().message();
  } else if (job.has_progress()) {
    details =
        absl::StrCat(StageWords(job.progress().stage()), " ", DescribeProgress(job.progress()));
  }
  return absl::StrFormat("%s  %-9s  %11s  %s", job.name(), StateWord(job), AgeOf(job), details);
}

int RunList(const ServerFlags& flags) {
  const absl::StatusOr<Connection> connection = Connect(flags.server, nullptr);
  if (!connection.ok()) return Fail(connection.status());
  const auto jobs = connection->client->ListJobs(flags.most);
  if (!jobs.ok()) return Fail(jobs.status());
  // Not on stdout, where scripts count lines.
  if (jobs->empty()) std::fprintf(stderr, "amhex: the server has no jobs that you may see\n");
  for (const v1::Job& job : *jobs) {
    std::printf("%s\n", flags.json ? ToJson(job).c_str() : OneLine(job).c_str());
  }
  return kExitSuccess;
}

int RunCancel(const ServerFlags& flags) {
  const absl::StatusOr<Connection> connection = Connect(flags.server, nullptr);
  if (!connection.ok()) return Fail(connection.status());
  const absl::StatusOr<v1::Job> job = connection->client->CancelJob(flags.name);
  if (!job.ok()) return Fail(job.status());
  std::printf("%s\n", OneLine(*job).c_str());
  return kExitSuccess;
}

int RunDelete(const ServerFlags& flags) {
  const absl::StatusOr<Connection> connection = Connect(flags.server, nullptr);
  if (!connection.ok()) return Fail(connection.status());
  const absl::Status status = connection->client->DeleteJob(flags.name);
  return status.ok() ? kExitSuccess : Fail(status);
}

void DescribeMesh(const std::string& path, const AtMostHexaMesh& mesh) {
  std::printf("%s: %zu cells, %zu vertices\n", path.c_str(), mesh.corners.size(),
              mesh.vertices.size());
  for (const PrimitiveType type : kPrimitiveTypes) {
    const auto count = std::count(mesh.types.begin(), mesh.types.end(), type);
    if (count > 0) std::printf("  %-12s %8td\n", PrimitiveName(type), count);
  }
  const double sum = std::accumulate(mesh.quality.begin(), mesh.quality.end(), 0.0);
  std::printf("  scaled Jacobian  least %.3f, average %.3f\n",
              *std::min_element(mesh.quality.begin(), mesh.quality.end()),
              sum / static_cast<double>(mesh.quality.size()));
}

int DescribeVolume(const std::string& path) {
  const absl::StatusOr<VolumeMesh> volume = ReadVolumeFile(path);
  if (!volume.ok()) return Fail(volume.status(), kExitInput);
  std::printf("%s: %zu cells, not all of them collapsed hexahedra, %zu vertices\n", path.c_str(),
              volume->cell_faces.size(), volume->vertices.size());
  return kExitSuccess;
}

int DescribeFile(const std::string& path) {
  if (MeshFormatOfPath(path)) {
    const absl::StatusOr<MeshDocument> document = ReadMeshFile(path);
    // Inputs may have cells that results have not.
    if (!document.ok() && VolumeFormatOfPath(path)) return DescribeVolume(path);
    if (!document.ok()) return Fail(document.status(), kExitInput);
    DescribeMesh(path, document->mesh);
    for (const MeshFact& fact : document->facts) {
      const std::string text = TextOf(fact);
      std::printf("  %s = %s\n", fact.name.c_str(), text.empty() ? "none" : text.c_str());
    }
    return kExitSuccess;
  }
  const absl::StatusOr<InputHull> hull = ReadHullFile(path);
  if (!hull.ok()) return Fail(hull.status(), kExitInput);
  const Box3d box = BoxOf(*hull);
  std::printf("%s: %s, box (%g, %g, %g) to (%g, %g, %g)\n", path.c_str(),
              DescribeHull(*hull).c_str(), box.low.x, box.low.y, box.low.z, box.high.x, box.high.y,
              box.high.z);
  return kExitSuccess;
}

int RunInfo(const ServerFlags& flags) {
  if (!flags.file.empty()) return DescribeFile(flags.file);
  Interrupt interrupt;
  const SignalWatcher signals(&interrupt);
  const absl::StatusOr<Connection> connection = Connect(flags.server, &interrupt);
  if (!connection.ok()) return Fail(connection.status());
  const auto capabilities = connection->client->GetCapabilities();
  if (!capabilities.ok()) return Fail(capabilities.status());
  if (flags.json) {
    std::printf("%s\n", ToJson(*capabilities).c_str());
    return kExitSuccess;
  }
  std::printf("server %s, engine %s, %d worker%s%s\n", capabilities->server_version().c_str(),
              capabilities->engine_version().empty() ? "not known yet"
                                                     : capabilities->engine_version().c_str(),
              capabilities->worker_count(), capabilities->worker_count() == 1 ? "" : "s",
              capabilities->draining() ? ", shutting down" : "");
  for (const v1::BackendInfo& backend : capabilities->backends()) {
    const auto* value = v1::Backend_descriptor()->FindValueByNumber(backend.backend());
    std::printf("  backend %-5s %s: %s\n", value != nullptr ? EnumWord(*value).c_str() : "?",
                backend.available() ? "available" : "not available", backend.description().c_str());
  }
  for (const MeshFact& limit : FactsOf("limits", capabilities->limits())) {
    std::printf("  %s = %.0f\n", limit.name.c_str(), std::get<double>(limit.value));
  }
  return kExitSuccess;
}

}  // namespace

void AddListCommand(CLI::App* app, int* exit_code) {
  auto flags = std::make_shared<ServerFlags>();
  CLI::App* command = app->add_subcommand("list", "List a server's jobs, newest first");
  command->add_option("-n,--most", flags->most, "Most jobs to list")
      ->check(Within(1, kMostListed))
      ->type_name("N")
      ->capture_default_str();
  command->add_flag("--json", flags->json, "One JSON object per job");
  AddServerFlags(command, LocalServers::kForbidden, &flags->server);
  command->footer(
      "Examples:\n"
      "  amhex list --server mesher:50051\n"
      "  amhex list -n 5 --json --server mesher:50051");
  command->callback([flags, exit_code] { *exit_code = RunList(*flags); });
}

void AddCancelCommand(CLI::App* app, int* exit_code) {
  auto flags = std::make_shared<ServerFlags>();
  CLI::App* command = app->add_subcommand("cancel", "Ask for the end of a job");
  command->add_option("job", flags->name, kJobHelp)->type_name("NAME")->required();
  AddServerFlags(command, LocalServers::kForbidden, &flags->server);
  command->footer("Example:\n  amhex cancel JOB --server mesher:50051");
  command->callback([flags, exit_code] { *exit_code = RunCancel(*flags); });
}

void AddDeleteCommand(CLI::App* app, int* exit_code) {
  auto flags = std::make_shared<ServerFlags>();
  CLI::App* command = app->add_subcommand("delete", "Remove a job that is done, and its result");
  command->add_option("job", flags->name, kJobHelp)->type_name("NAME")->required();
  AddServerFlags(command, LocalServers::kForbidden, &flags->server);
  command->footer("Example:\n  amhex delete JOB --server mesher:50051");
  command->callback([flags, exit_code] { *exit_code = RunDelete(*flags); });
}

void AddInfoCommand(CLI::App* app, int* exit_code) {
  auto flags = std::make_shared<ServerFlags>();
  CLI::App* command =
      app->add_subcommand("info", "Tell what a server can do, or what a file holds");
  command->add_option("file", flags->file, "Scan, surface or volume mesh to describe")
      ->type_name("FILE");
  command->add_flag("--json", flags->json, "The server's answer as JSON");
  AddServerFlags(command, LocalServers::kAllowed, &flags->server);
  command->footer(
      "Examples:\n"
      "  amhex info part.stl\n"
      "  amhex info part.vtu\n"
      "  amhex info --server mesher:50051");
  command->callback([flags, exit_code] { *exit_code = RunInfo(*flags); });
}

}  // namespace amhex::client
