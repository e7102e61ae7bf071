#include "cli/local_server.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"

namespace amhex::client {
namespace {

// A worker of many GPUs takes seconds to find them.
constexpr absl::Duration kStartPatience = absl::Seconds(60);
constexpr absl::Duration kStopPatience = absl::Seconds(10);
constexpr absl::Duration kPollInterval = absl::Milliseconds(20);

std::filesystem::path OwnFolder() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
}

bool IsProgram(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error) && access(path.c_str(), X_OK) == 0;
}

bool Exists(const std::string& path) {
  std::error_code ignored;
  return std::filesystem::exists(path, ignored);
}

absl::StatusOr<std::string> MakeFolder() {
  const char* base = std::getenv("TMPDIR");  // NOLINT(concurrency-mt-unsafe)
  std::string folder =
      absl::StrCat(base != nullptr && *base != '\0' ? base : "/tmp", "/amhex-XXXXXX");
  if (mkdtemp(folder.data()) == nullptr) {
    return absl::UnavailableError(absl::StrCat("no folder for a private server: ", folder, ": ",
                                               std::generic_category().message(errno)));
  }
  return folder;
}

std::vector<std::string> Arguments(const std::string& program, const std::string& folder) {
  return {program,
          "--listen",
          absl::StrCat("unix:", folder, "/socket"),
          "--ephemeral",
          "--metrics-listen",
          "",
          "--drain-timeout",
          "1"};
}

// Runs in the child between fork and exec: only async-signal-safe calls.
[[noreturn]] void RunServer(char* const* argv, int log, pid_t parent) {
  setpgid(0, 0);  // Ctrl-C is for the client, which then stops the server in order
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(1);
  sigset_t none;
  sigemptyset(&none);
  pthread_sigmask(SIG_SETMASK, &none, nullptr);
  std::signal(SIGPIPE, SIG_DFL);
  const int null = open("/dev/null", O_RDONLY);
  dup2(null, STDIN_FILENO);
  dup2(log, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  execv(argv[0], argv);
  _exit(127);
}

absl::StatusOr<pid_t> Spawn(const std::string& program, const std::string& folder) {
  std::vector<std::string> arguments = Arguments(program, folder);
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const std::string log_path = folder + "/log";
  const int log = open(log_path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  const pid_t parent = getpid();
  const pid_t pid = log < 0 ? -1 : fork();
  if (pid == 0) RunServer(argv.data(), log, parent);
  const int error = errno;
  if (log >= 0) close(log);
  if (pid < 0) {
    return absl::UnavailableError(absl::StrCat("a private server cannot be started: ",
                                               std::generic_category().message(error)));
  }
  return pid;
}

}  // namespace

absl::StatusOr<std::string> FindServerProgram() {
  const char* named = std::getenv("AMHEXD");  // NOLINT(concurrency-mt-unsafe)
  if (named != nullptr && *named != '\0') {
    if (IsProgram(named)) return std::string(named);
    return absl::NotFoundError(absl::StrCat("AMHEXD names ", named, ", which is no program"));
  }
  const std::filesystem::path own = OwnFolder();
  std::vector<std::filesystem::path> places = {own / "amhexd", own / "../server/amhexd"};
  const char* path = std::getenv("PATH");  // NOLINT(concurrency-mt-unsafe)
  if (path != nullptr) {
    for (absl::string_view folder : absl::StrSplit(path, ':', absl::SkipEmpty())) {
      places.emplace_back(std::filesystem::path(std::string(folder)) / "amhexd");
    }
  }
  for (const std::filesystem::path& place : places) {
    if (IsProgram(place)) return place.lexically_normal().string();
  }
  return absl::NotFoundError(
      absl::StrCat("amhexd was found neither beside amhex (", own.string(),
                   ") nor in PATH; set AMHEXD to its path, or use --server ADDRESS"));
}

absl::StatusOr<std::unique_ptr<LocalServer>> LocalServer::Start(Interrupt* interrupt) {
  const absl::StatusOr<std::string> program = FindServerProgram();
  if (!program.ok()) return absl::UnavailableError(std::string(program.status().message()));
  const absl::StatusOr<std::string> folder = MakeFolder();
  if (!folder.ok()) return folder.status();
  const absl::StatusOr<pid_t> pid = Spawn(*program, *folder);
  if (!pid.ok()) {
    std::error_code ignored;
    std::filesystem::remove_all(*folder, ignored);
    return pid.status();
  }
  std::unique_ptr<LocalServer> server(new LocalServer(*folder, *pid));
  const absl::Status ready = server->WaitUntilReady(interrupt);
  if (!ready.ok()) return ready;
  return server;
}

bool LocalServer::HasEnded() {
  if (!ended_ && waitpid(pid_, nullptr, WNOHANG) == pid_) ended_ = true;
  return ended_;
}

absl::Status LocalServer::WaitUntilReady(Interrupt* interrupt) {
  const absl::Time deadline = absl::Now() + kStartPatience;
  Client client({.address = address(), .patience = absl::Milliseconds(1), .interrupt = interrupt});
  while (absl::Now() < deadline) {
    if (interrupt != nullptr && interrupt->requested()) return absl::CancelledError("interrupted");
    if (HasEnded()) {
      return absl::UnavailableError(
          absl::StrCat("the private server ended while starting:\n", LogTail()));
    }
    if (Exists(folder_ + "/socket")) {
      const auto capabilities = client.GetCapabilities();
      if (capabilities.ok() && capabilities->worker_count() > 0) return absl::OkStatus();
      if (capabilities.ok() && capabilities->quarantined_worker_count() > 0) {
        return absl::UnavailableError(
            absl::StrCat("the private server's worker does not start:\n", LogTail()));
      }
    }
    absl::SleepFor(kPollInterval);
  }
  return absl::UnavailableError(absl::StrCat("the private server was not ready within ",
                                             absl::FormatDuration(kStartPatience), ":\n",
                                             LogTail()));
}

std::string LocalServer::LogTail() const {
  constexpr size_t kLines = 5;
  std::ifstream file(folder_ + "/log");
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) {
    lines.push_back(line);
    if (lines.size() > kLines) lines.erase(lines.begin());
  }
  return lines.empty() ? "(it logged nothing)" : absl::StrJoin(lines, "\n");
}

LocalServer::~LocalServer() {
  if (!HasEnded()) kill(pid_, SIGTERM);
  const absl::Time deadline = absl::Now() + kStopPatience;
  while (!HasEnded() && absl::Now() < deadline) absl::SleepFor(kPollInterval);
  if (!HasEnded()) {
    kill(-pid_, SIGKILL);
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

}  // namespace amhex::client
