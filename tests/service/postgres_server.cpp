#include "postgres_server.h"

#include <pwd.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <vector>

#include "absl/time/clock.h"
#include "test_addresses.h"

namespace amhex::server {
namespace {

constexpr char kPrograms[] = AMHEX_POSTGRES_PROGRAMS;
constexpr char kAccount[] = "postgres";

// PostgreSQL refuses to run as root; its package has made an account for it.
void BecomeDatabaseUser() {
  if (geteuid() != 0) return;
  const passwd* account = getpwnam(kAccount);
  if (account == nullptr || setgid(account->pw_gid) != 0 || setuid(account->pw_uid) != 0) _exit(1);
}

pid_t Spawn(const std::vector<std::string>& command, const std::string& log) {
  const pid_t pid = fork();
  if (pid != 0) return pid;
  BecomeDatabaseUser();
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // a change of user would forget it
  if (std::freopen(log.c_str(), "a", stdout) == nullptr || dup2(1, 2) < 0) _exit(1);
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  execv(arguments[0], arguments.data());
  _exit(127);
}

bool Run(const std::vector<std::string>& command, const std::string& log) {
  int status = 0;
  waitpid(Spawn(command, log), &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

[[noreturn]] void GiveUp(const std::string& what, const std::string& log) {
  std::cerr << "PostgreSQL: " << what << "\n" << std::ifstream(log).rdbuf() << std::endl;
  std::abort();
}

}  // namespace

PostgresServer::PostgresServer() : host_(OwnAddress()), port_(NextPort()) {
  std::filesystem::permissions(folder_ / "", std::filesystem::perms::all);
  if (!Run({std::string(kPrograms) + "/initdb", "-D", folder_ / "data", "-A", "trust", "-U",
            kAccount, "--no-sync", "-E", "UTF8", "--locale=C"},
           folder_ / "log")) {
    GiveUp("initdb failed", folder_ / "log");
  }
  std::ofstream(folder_ / "data/pg_hba.conf", std::ios::app) << "host all all all trust\n";
  Start();
}

PostgresServer::~PostgresServer() { Kill(); }

void PostgresServer::Start() {
  pid_ = Spawn({std::string(kPrograms) + "/postgres", "-D", folder_ / "data", "-h", host_, "-p",
                std::to_string(port_), "-k", "", "-c", "max_connections=200"},
               folder_ / "log");
  if (!Eventually([this] { return Answers(); }, absl::Seconds(60))) {
    GiveUp("does not start", folder_ / "log");
  }
}

bool PostgresServer::Answers() const {
  return Run(
      {std::string(kPrograms) + "/pg_isready", "-q", "-h", host_, "-p", std::to_string(port_)},
      "/dev/null");
}

void PostgresServer::Kill() {
  if (pid_ == 0) return;
  Resume();
  // The immediate shutdown: its processes end at once, as in a crash, and it recovers on start.
  kill(pid_, SIGQUIT);
  waitpid(pid_, nullptr, 0);
  pid_ = 0;
}

void PostgresServer::Pause() { kill(pid_, SIGSTOP); }
void PostgresServer::Resume() { kill(pid_, SIGCONT); }

bool PostgresServer::RunProgram(const std::string& program, const std::string& url,
                                const std::vector<std::string>& arguments) {
  std::vector<std::string> command = {std::string(kPrograms) + "/" + program, "-d", url};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return Run(command, folder_ / "log");
}

std::string PostgresServer::MakeDatabase() {
  // A schema of its own is as good as a database, and is made in no time.
  const std::string name = "test" + std::to_string(++database_count_);
  const std::string url = "postgres://" + std::string(kAccount) + "@" + host_ + ":" +
                          std::to_string(port_) + "/postgres";
  if (!RunProgram("psql", url, {"-q", "-c", "CREATE SCHEMA " + name})) {
    GiveUp("cannot make a schema", folder_ / "log");
  }
  return url + "?options=-csearch_path%3D" + name;
}

PostgresServer& SharedPostgres() {
  static PostgresServer server;
  return server;
}

}  // namespace amhex::server
