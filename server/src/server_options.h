// Every option of amhexd: its flag, environment name, default and unit.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "server_credentials.h"
#include "service_limits.h"

namespace amhex::server {

struct ServerOptions {
  // Addresses to serve on: host:port (port 0: any free one) or unix:/path.
  std::vector<std::string> listen = {"127.0.0.1:50051"};
  // Address of the Prometheus page, host:port; empty: none.
  std::string metrics_listen = "127.0.0.1:9464";
  // Permits plaintext and unknown callers on addresses other machines can reach, for the page too.
  bool insecure = false;
  // The same for the Prometheus page alone, which is always plain HTTP.
  bool metrics_insecure = false;
  // What gRPC may hold of messages and calls of all connections together, whoever the callers are.
  // The default is for all uploads at once, each with its chunks of 1 MiB and what is under way.
  int64_t message_memory_bytes = 512 * kMebibyte;
  TlsFiles tls;
  // File of tokens (token_file.h); empty: callers need none.
  std::string tokens;
  // How this node calls the others of a cluster: file of a token with the role read-all, and PEM
  // file of the authorities of their certificates. Empty: none, plaintext.
  std::string peer_token;
  std::string peer_ca;
  // Whether equal jobs of a tenant share one result.
  bool share_results = true;

  // Where the queue is kept: "sqlite", in the data folder, or postgres://..., shared by all nodes
  // of a cluster; then they share the data folder as well.
  std::string store = "sqlite";
  // File whose text takes the place of `store`, for one that holds a password; empty: none.
  std::string store_file;
  // This server among the nodes of a cluster; empty: the machine's name.
  std::string node_name;
  // host:port where the other nodes reach this one; empty: the first of `listen`.
  std::string advertise;
  // A node that is silent for so long loses its jobs to others.
  absl::Duration lease = absl::Seconds(30);

  // Folder of the queue and the blobs.
  std::string data_dir = "/var/lib/amhex";
  // Keeps everything in a temporary folder that goes with the process; data_dir is not used.
  bool ephemeral = false;
  // File to write once the server serves: lines "grpc=ADDRESS" and "metrics=ADDRESS". Empty: none.
  std::string port_file;

  // The worker's executable; empty: amhex-worker beside this executable.
  std::string worker;
  int worker_count = 1;
  // CUDA devices, as CUDA_VISIBLE_DEVICES names them, one to each worker in turn; empty: each
  // worker sees all.
  std::vector<std::string> cuda_devices;

  // Time between NOT_SERVING and the end of accepting, for load balancers to notice.
  absl::Duration drain_delay = absl::ZeroDuration();
  // Time for running jobs to finish on shutdown; then they go back to the queue.
  absl::Duration drain_timeout = absl::Seconds(30);

  // Prints a fresh token and ends.
  bool new_token = false;
  // Checks the options and the files they name, prints the configuration and ends.
  bool check_config = false;
  // Every option with the value in force, one "name=value" per line, secrets masked.
  std::string effective;

  std::string log_level = "info";
  std::string log_format = "text";  // or json
  Limits limits;
};

// Reads flags and environment. On --help or a bad flag, prints and returns the exit code to end
// with in `exit_code`, and an error.
absl::StatusOr<ServerOptions> ParseOptions(int argc, char** argv, int* exit_code);

// INVALID_ARGUMENT naming the flag, the value and what is permitted.
absl::Status Validate(const ServerOptions& options);

bool IsUnixAddress(const std::string& address);
// True for unix sockets and loopback addresses.
bool IsLocalAddress(const std::string& address);

}  // namespace amhex::server
