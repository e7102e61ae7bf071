// `amhexd`: the meshing service. Ends on SIGTERM or SIGINT; a second one ends it at once.
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <iostream>
#include <string>
#include <thread>

#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include "files.h"
#include "init_process.h"
#include "logging.h"
#include "server.h"
#include "server_options.h"
#include "sha256.h"
#include "token_file.h"

namespace amhex::server {
namespace {

constexpr int kBadConfiguration = 2;

// Blocks the signals that end the server in this and all later threads; they are waited for.
sigset_t BlockEndingSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal(SIGPIPE, SIG_IGN);
  return signals;
}

absl::Status WritePortFile(const Server& server, const std::string& path) {
  if (path.empty()) return absl::OkStatus();
  std::string lines;
  for (const std::string& address : server.addresses()) lines += "grpc=" + address + "\n";
  if (!server.metrics_address().empty()) lines += "metrics=" + server.metrics_address() + "\n";
  return WriteFileAtomically(path, lines);
}

void ServeUntilSignal(Server* server, const ServerOptions& options, const sigset_t& signals) {
  int signal_number = 0;
  sigwait(&signals, &signal_number);
  std::atomic<bool> done{false};
  std::thread stopper([&] {
    server->Stop(absl::Now() + options.drain_delay + options.drain_timeout);
    done = true;
  });
  const timespec pause{0, 50'000'000};
  while (!done) {
    if (sigtimedwait(&signals, nullptr, &pause) > 0) server->Stop(absl::Now());
  }
  stopper.join();
}

int Serve(const ServerOptions& options) {
  if (const absl::Status status = SetUpLogging(options.log_level, options.log_format);
      !status.ok()) {
    std::cerr << "amhexd: " << status.message() << "\n";
    return EXIT_FAILURE;
  }
  const sigset_t signals = BlockEndingSignals();
  for (const auto line : absl::StrSplit(options.effective, '\n', absl::SkipEmpty())) {
    LogInfo("option", {{"line", std::string(line)}});
  }
  const auto server = Server::Create(options);
  absl::Status status = server.status();
  if (status.ok()) status = WritePortFile(**server, options.port_file);
  if (!status.ok()) {
    LogError("start_failed", {{"message", std::string(status.message())}});
    return EXIT_FAILURE;
  }
  ServeUntilSignal(server->get(), options, signals);
  return EXIT_SUCCESS;
}

int Main(int argc, char** argv) {
  int exit_code = EXIT_SUCCESS;
  const auto options = ParseOptions(argc, argv, &exit_code);
  if (options.ok() && options->new_token) {
    const std::string token = NewToken();
    std::cout << "token:   " << token << "\nSHA-256: " << Sha256Hex(token) << "\n";
    return EXIT_SUCCESS;
  }
  if (!options.ok()) {
    if (exit_code != EXIT_SUCCESS) std::cerr << "amhexd: " << options.status().message() << "\n";
    return exit_code;
  }
  if (options->check_config) {
    const absl::Status verdict = Server::Check(*options);
    std::cout << options->effective;
    if (!verdict.ok()) std::cerr << "amhexd: " << verdict.message() << "\n";
    return verdict.ok() ? EXIT_SUCCESS : kBadConfiguration;
  }
  const bool is_first_of_container = getpid() == 1;
  return is_first_of_container ? ServeUnderInit([&] { return Serve(*options); }) : Serve(*options);
}

}  // namespace
}  // namespace amhex::server

int main(int argc, char** argv) { return amhex::server::Main(argc, argv); }
