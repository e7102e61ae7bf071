#include "server_options.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <climits>
#include <filesystem>
#include <regex>

#include "absl/strings/ascii.h"
#include "files.h"
#include "logging.h"
#include "store_choice.h"
#include "version.h"

namespace amhex::server {
namespace {

// So many of the largest messages find room at the same time.
constexpr int64_t kLeastMessages = 8;
// Heartbeats come every third of a lease; an expired one delays its job by as much.
constexpr absl::Duration kMinLease = absl::Seconds(1);
constexpr absl::Duration kMaxLease = absl::Minutes(10);
constexpr char kUnixPrefix[] = "unix:";

bool StartsWith(const std::string& text, const std::string& prefix) {
  return text.compare(0, prefix.size(), prefix) == 0;
}

// amhex-worker in the folder of this executable.
std::string DefaultWorker() {
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? "amhex-worker" : (self.parent_path() / "amhex-worker").string();
}

// Memory for one worker so that all together leave a fifth of the machine alone.
int64_t DefaultWorkerMemory(int worker_count) {
  const int64_t total = int64_t{sysconf(_SC_PHYS_PAGES)} * sysconf(_SC_PAGESIZE);
  return total / 5 * 4 / std::max(worker_count, 1);
}

// Options that CLI11 reads as plain numbers.
struct RawSeconds {
  double drain_delay;
  double lease;
  double drain_timeout;
  double max_run;
  double max_retention;
  double retention;
  double quarantine;
  double connection_age;
};

void AddServingFlags(CLI::App* app, ServerOptions* options) {
  app->add_option("--listen", options->listen, "Address to serve on: host:port or unix:/path")
      ->envname("AMHEX_LISTEN")
      ->delimiter(',')
      ->capture_default_str();
  app->add_option("--metrics-listen", options->metrics_listen,
                  "Address of the Prometheus page; empty: none")
      ->envname("AMHEX_METRICS_LISTEN")
      ->capture_default_str();
  app->add_flag("--insecure", options->insecure,
                "Permit plaintext and unknown callers on addresses that other machines can reach")
      ->envname("AMHEX_INSECURE");
  app->add_flag(
         "--metrics-insecure", options->metrics_insecure,
         "Permit the Prometheus page, plain HTTP, on an address that other machines can reach")
      ->envname("AMHEX_METRICS_INSECURE");
  app->add_option("--message-memory-bytes", options->message_memory_bytes,
                  "Memory for the messages and calls of all connections together")
      ->envname("AMHEX_MESSAGE_MEMORY_BYTES")
      ->capture_default_str();
  app->add_option("--data-dir", options->data_dir, "Folder of the queue and the blobs")
      ->envname("AMHEX_DATA_DIR")
      ->capture_default_str();
  app->add_flag("--ephemeral", options->ephemeral, "Forget everything at the end")
      ->envname("AMHEX_EPHEMERAL");
  app->add_option("--port-file", options->port_file,
                  "File to write the addresses to once the server serves")
      ->envname("AMHEX_PORT_FILE");
  app->add_option("--log-level", options->log_level, "trace, debug, info, warning or error")
      ->envname("AMHEX_LOG_LEVEL")
      ->capture_default_str();
  app->add_option("--log-format", options->log_format,
                  "Log lines: text (key=value) or json (an object each)")
      ->envname("AMHEX_LOG_FORMAT")
      ->capture_default_str();
}

void AddClusterFlags(CLI::App* app, ServerOptions* options) {
  app->add_option("--store", options->store,
                  "Where the queue is kept: sqlite, or postgres://... to share it with other nodes")
      ->envname("AMHEX_STORE")
      ->capture_default_str();
  app->add_option("--store-file", options->store_file,
                  "File of what --store would say, for one that holds a password")
      ->envname("AMHEX_STORE_FILE");
  app->add_option("--node-name", options->node_name,
                  "Name among the nodes that share a store; the machine's if not given")
      ->envname("AMHEX_NODE_NAME");
  app->add_option("--advertise", options->advertise,
                  "host:port where the other nodes reach this one; the first --listen if not given")
      ->envname("AMHEX_ADVERTISE");
  app->add_option("--peer-token", options->peer_token,
                  "File of a token with the role read-all, shown to the other nodes")
      ->envname("AMHEX_PEER_TOKEN");
  app->add_option("--peer-ca", options->peer_ca,
                  "PEM file of the authorities of the other nodes' certificates; empty: plaintext")
      ->envname("AMHEX_PEER_CA");
}

std::string MachineName() {
  char name[HOST_NAME_MAX + 1] = {};
  return gethostname(name, sizeof(name) - 1) == 0 ? name : "";
}

void AddSecurityFlags(CLI::App* app, ServerOptions* options) {
  app->add_option("--tls-cert", options->tls.certificate, "PEM file of the server's certificate")
      ->envname("AMHEX_TLS_CERT");
  app->add_option("--tls-key", options->tls.key, "PEM file of the certificate's key")
      ->envname("AMHEX_TLS_KEY");
  app->add_option("--tls-client-ca", options->tls.client_ca,
                  "PEM file of the authorities whose certificates callers must show")
      ->envname("AMHEX_TLS_CLIENT_CA");
  app->add_option("--tokens", options->tokens, "File of the tokens callers must show")
      ->envname("AMHEX_TOKENS");
  app->add_flag("--check-config", options->check_config,
                "Check the options and the files they name, print the configuration, and end")
      ->configurable(false);
  app->add_flag("--new-token", options->new_token, "Print a fresh token and its digest, and end")
      ->configurable(false);
}

void AddWorkerFlags(CLI::App* app, ServerOptions* options) {
  app->add_option("--worker", options->worker, "Executable of the workers")
      ->envname("AMHEX_WORKER");
  app->add_option("--workers", options->worker_count, "Jobs that run at the same time")
      ->envname("AMHEX_WORKERS")
      ->capture_default_str();
  app->add_option(
         "--cuda-devices", options->cuda_devices,
         "CUDA devices, numbers or UUIDs; each worker in turn sees one; empty: all see all")
      ->envname("AMHEX_CUDA_DEVICES")
      ->delimiter(',');
  options->limits.max_worker_memory_bytes = -1;
  app->add_option("--worker-memory-bytes", options->limits.max_worker_memory_bytes,
                  "Memory of one worker; 0: no bound; -1: 80 % of the machine's, shared")
      ->envname("AMHEX_WORKER_MEMORY_BYTES")
      ->capture_default_str();
  options->limits.max_running_memory_bytes = -1;
  app->add_option("--running-memory-bytes", options->limits.max_running_memory_bytes,
                  "Memory that the running jobs may be expected to take together; 0: no bound; -1: "
                  "80 % of the machine's")
      ->envname("AMHEX_RUNNING_MEMORY_BYTES")
      ->capture_default_str();
}

void AddLimitFlags(CLI::App* app, Limits* limits) {
  app->add_option("--max-blob-bytes", limits->max_blob_bytes, "Largest input")
      ->envname("AMHEX_MAX_BLOB_BYTES")
      ->capture_default_str();
  app->add_option("--max-blob-store-bytes", limits->max_blob_store_bytes,
                  "All inputs and results together; 0: no bound")
      ->envname("AMHEX_MAX_BLOB_STORE_BYTES")
      ->capture_default_str();
  app->add_option("--min-free-disk-bytes", limits->min_free_disk_bytes,
                  "Bytes of the disk that inputs leave to the queue and to results")
      ->envname("AMHEX_MIN_FREE_DISK_BYTES")
      ->capture_default_str();
  app->add_option("--max-queued-jobs", limits->max_queued_job_count, "Jobs that may wait")
      ->envname("AMHEX_MAX_QUEUED_JOBS")
      ->capture_default_str();
  app->add_option("--max-points", limits->max_point_count, "Points of an input")
      ->envname("AMHEX_MAX_POINTS")
      ->capture_default_str();
  app->add_option("--max-triangles", limits->max_triangle_count, "Triangles of an input")
      ->envname("AMHEX_MAX_TRIANGLES")
      ->capture_default_str();
  app->add_option("--max-attributes", limits->max_attribute_count, "Attributes of a Draco input")
      ->envname("AMHEX_MAX_ATTRIBUTES")
      ->capture_default_str();
  app->add_option("--max-attempts", limits->max_attempts,
                  "Attempts before a job whose worker keeps dying fails")
      ->envname("AMHEX_MAX_ATTEMPTS")
      ->capture_default_str();
}

void AddCallLimitFlags(CLI::App* app, Limits* limits) {
  app->add_option("--max-labels", limits->max_label_count, "Labels of a job")
      ->envname("AMHEX_MAX_LABELS")
      ->capture_default_str();
  app->add_option("--max-label-bytes", limits->max_label_bytes, "Bytes of a label's key or value")
      ->envname("AMHEX_MAX_LABEL_BYTES")
      ->capture_default_str();
  app->add_option("--max-watchers", limits->max_watcher_count, "Streams that watch one job")
      ->envname("AMHEX_MAX_WATCHERS")
      ->capture_default_str();
  app->add_option("--max-tenant-watchers", limits->max_tenant_watcher_count,
                  "Streams that one tenant watches with")
      ->envname("AMHEX_MAX_TENANT_WATCHERS")
      ->capture_default_str();
  app->add_option("--max-uploads", limits->max_upload_count, "Uploads under way at the same time")
      ->envname("AMHEX_MAX_UPLOADS")
      ->capture_default_str();
  app->add_option("--max-page-size", limits->max_page_size, "Jobs on one page of a list")
      ->envname("AMHEX_MAX_PAGE_SIZE")
      ->capture_default_str();
}

void AddTimeFlags(CLI::App* app, RawSeconds* seconds) {
  app->add_option("--drain-delay", seconds->drain_delay,
                  "Seconds between NOT_SERVING and the end of accepting")
      ->envname("AMHEX_DRAIN_DELAY")
      ->capture_default_str();
  app->add_option("--lease-seconds", seconds->lease,
                  "Silence after which a worker or node loses its job")
      ->envname("AMHEX_LEASE_SECONDS")
      ->capture_default_str();
  app->add_option("--drain-timeout", seconds->drain_timeout,
                  "Seconds for running jobs to finish on shutdown")
      ->envname("AMHEX_DRAIN_TIMEOUT")
      ->capture_default_str();
  app->add_option("--max-run-seconds", seconds->max_run, "Longest run of a job")
      ->envname("AMHEX_MAX_RUN_SECONDS")
      ->capture_default_str();
  app->add_option("--max-retention-seconds", seconds->max_retention,
                  "Longest time a job may ask to be kept")
      ->envname("AMHEX_MAX_RETENTION_SECONDS")
      ->capture_default_str();
  app->add_option("--retention-seconds", seconds->retention,
                  "Time a finished job is kept if it does not say")
      ->envname("AMHEX_RETENTION_SECONDS")
      ->capture_default_str();
  app->add_option("--quarantine-seconds", seconds->quarantine,
                  "Time for which what has killed its workers is refused; 0: none")
      ->envname("AMHEX_QUARANTINE_SECONDS")
      ->capture_default_str();
  app->add_option("--max-connection-seconds", seconds->connection_age,
                  "Age at which a connection takes no new calls; 0: none")
      ->envname("AMHEX_MAX_CONNECTION_SECONDS")
      ->capture_default_str();
}

// Hides the password of URLs like postgres://user:password@host/name, which may hold an @, or
// postgres://host/name?password=password.
std::string MaskPasswords(const std::string& text) {
  static const std::regex kOfUser("(://[^:/@\\s\"']*:)[^\\s\"']*@");
  static const std::regex kParameter("(password=)[^&\\s\"']*");
  return std::regex_replace(std::regex_replace(text, kOfUser, "$1***@"), kParameter, "$1***");
}

absl::Status Refuse(const std::string& problem) { return absl::InvalidArgumentError(problem); }

}  // namespace

absl::StatusOr<ServerOptions> ParseOptions(int argc, char** argv, int* exit_code) {
  ServerOptions options;
  RawSeconds seconds{absl::ToDoubleSeconds(options.drain_delay),
                     absl::ToDoubleSeconds(options.lease),
                     absl::ToDoubleSeconds(options.drain_timeout),
                     absl::ToDoubleSeconds(options.limits.max_run_duration),
                     absl::ToDoubleSeconds(options.limits.max_retention_duration),
                     absl::ToDoubleSeconds(options.limits.default_retention_duration),
                     absl::ToDoubleSeconds(options.limits.quarantine_duration),
                     absl::ToDoubleSeconds(options.limits.max_connection_age)};
  CLI::App app("amhexd: turns scans into at-most-hexa volume meshes, as a gRPC service");
  app.set_version_flag("--version", std::string(kServerVersion));
  AddServingFlags(&app, &options);
  AddClusterFlags(&app, &options);
  AddSecurityFlags(&app, &options);
  AddWorkerFlags(&app, &options);
  AddLimitFlags(&app, &options.limits);
  AddCallLimitFlags(&app, &options.limits);
  AddTimeFlags(&app, &seconds);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    *exit_code = app.exit(error);
    return Refuse("the command line was not understood");
  }
  options.effective = MaskPasswords(app.config_to_str(true, false));
  options.drain_delay = absl::Seconds(seconds.drain_delay);
  options.lease = absl::Seconds(seconds.lease);
  options.drain_timeout = absl::Seconds(seconds.drain_timeout);
  options.limits.max_run_duration = absl::Seconds(seconds.max_run);
  options.limits.max_retention_duration = absl::Seconds(seconds.max_retention);
  options.limits.default_retention_duration = absl::Seconds(seconds.retention);
  options.limits.quarantine_duration = absl::Seconds(seconds.quarantine);
  options.limits.max_connection_age = absl::Seconds(seconds.connection_age);
  *exit_code = 2;
  if (!options.store_file.empty()) {
    const auto text = ReadWholeFile(options.store_file);
    if (!text.ok()) return Refuse("--store-file " + options.store_file + " cannot be read");
    options.store = std::string(absl::StripAsciiWhitespace(*text));
  }
  if (options.node_name.empty()) options.node_name = MachineName();
  if (options.worker.empty()) options.worker = DefaultWorker();
  if (options.limits.max_worker_memory_bytes < 0) {
    options.limits.max_worker_memory_bytes = DefaultWorkerMemory(options.worker_count);
  }
  if (options.limits.max_running_memory_bytes < 0) {
    options.limits.max_running_memory_bytes = DefaultWorkerMemory(1);
  }
  if (const absl::Status status = Validate(options); !status.ok()) return status;
  return options;
}

absl::Status Validate(const ServerOptions& options) {
  if (options.listen.empty()) return Refuse("--listen needs at least one address");
  if (absl::Status status = CheckLogging(options.log_level, options.log_format); !status.ok()) {
    return status;
  }
  if (absl::Status status = CheckTlsFiles(options.tls); !status.ok()) return status;
  if (absl::Status status = CheckPeerCa(options.peer_ca); !status.ok()) return status;
  const bool callers_known = !options.tokens.empty() || !options.tls.client_ca.empty();
  for (const std::string& address : options.listen) {
    if (IsLocalAddress(address) || options.insecure) continue;
    if (!options.tls.wanted()) {
      return Refuse("--listen " + address +
                    " can be reached by other machines in plaintext; give --tls-cert and --tls-key,"
                    " or --insecure if that is wanted, e.g. behind a proxy");
    }
    if (!callers_known) {
      return Refuse("--listen " + address +
                    " can be reached by anybody; give --tokens or --tls-client-ca, or --insecure "
                    "if that is wanted");
    }
  }
  if (!options.metrics_listen.empty() && !IsLocalAddress(options.metrics_listen) &&
      !options.insecure && !options.metrics_insecure) {
    return Refuse("--metrics-listen " + options.metrics_listen +
                  " can be read by other machines in plain HTTP; give --metrics-insecure if that "
                  "is wanted");
  }
  if (absl::Status status = ValidateStore(options); !status.ok()) return status;
  if (IsCluster(options) && callers_known && options.peer_token.empty()) {
    return Refuse("--peer-token is needed where nodes ask callers who they are");
  }
  if (options.worker_count < 1 || options.worker_count > 64) {
    return Refuse("--workers must be in [1, 64], got " + std::to_string(options.worker_count));
  }
  if (options.cuda_devices.size() > static_cast<size_t>(options.worker_count)) {
    return Refuse("--cuda-devices names " + std::to_string(options.cuda_devices.size()) +
                  " devices, but --workers only " + std::to_string(options.worker_count) +
                  " workers to own them");
  }
  if (access(options.worker.c_str(), X_OK) != 0) {
    return Refuse("--worker " + options.worker + " is no executable file");
  }
  const Limits& limits = options.limits;
  if (options.message_memory_bytes < kLeastMessages * limits.max_message_bytes) {
    return Refuse("--message-memory-bytes must be at least " +
                  std::to_string(kLeastMessages * limits.max_message_bytes));
  }
  const int64_t least = std::min<int64_t>(
      {limits.max_blob_bytes, limits.max_queued_job_count, limits.max_point_count,
       limits.max_triangle_count, limits.max_attribute_count, limits.max_attempts,
       limits.max_label_count, limits.max_label_bytes, limits.max_watcher_count,
       limits.max_tenant_watcher_count, limits.max_upload_count, limits.max_page_size});
  if (least < 1 || limits.max_blob_store_bytes < 0 || limits.min_free_disk_bytes < 0) {
    return Refuse("a --max option is not positive, or --min-free-disk-bytes is negative");
  }
  if (options.lease < kMinLease || options.lease > kMaxLease) {
    return Refuse("--lease-seconds must be in [1, 600], got " +
                  absl::FormatDuration(options.lease));
  }
  if (limits.max_run_duration <= absl::ZeroDuration() ||
      limits.default_retention_duration <= absl::ZeroDuration() ||
      limits.default_retention_duration > limits.max_retention_duration ||
      limits.quarantine_duration < absl::ZeroDuration() ||
      limits.max_connection_age < absl::ZeroDuration() ||
      options.drain_delay < absl::ZeroDuration() || options.drain_timeout < absl::ZeroDuration()) {
    return Refuse("a time is not positive, or --retention-seconds exceeds its maximum");
  }
  return absl::OkStatus();
}

bool IsUnixAddress(const std::string& address) {
  return StartsWith(address, kUnixPrefix) || StartsWith(address, "unix-abstract:");
}

bool IsLocalAddress(const std::string& address) {
  // A number, not a name that begins like one.
  const bool is_number =
      address.substr(0, address.rfind(':')).find_first_not_of("0123456789.") == std::string::npos;
  return IsUnixAddress(address) || (StartsWith(address, "127.") && is_number) ||
         StartsWith(address, "localhost:") || StartsWith(address, "[::1]:");
}

}  // namespace amhex::server
