#include "process_view.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

extern char** environ;

namespace amhex::server {
namespace {

std::filesystem::path ProcOf(pid_t pid) { return "/proc/" + std::to_string(pid); }

}  // namespace

std::vector<pid_t> ChildrenOf(pid_t parent) {
  std::vector<pid_t> children;
  std::error_code error;
  // Processes come and go while they are listed.
  std::filesystem::directory_iterator entry("/proc", error);
  for (; entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    // Line by line, for these calls report a process that ends while it is read in the stream's
    // state; the stream's bare buffer would throw.
    std::ifstream file(entry->path() / "stat");
    std::string text;
    for (std::string line; std::getline(file, line);) text += line;
    const size_t close = text.rfind(')');
    if (close == std::string::npos) continue;
    std::istringstream rest(text.substr(close + 1));
    char state = 0;
    pid_t found = 0;
    rest >> state >> found;
    if (found == parent) children.push_back(std::atoi(name.c_str()));
  }
  return children;
}

std::vector<std::string> DescriptorsOf(pid_t pid) {
  std::vector<std::string> found;
  std::error_code error;
  std::filesystem::directory_iterator entry(ProcOf(pid) / "fd", error);
  for (; entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    // Empty for one that was closed in between.
    const std::filesystem::path what = std::filesystem::read_symlink(entry->path(), error);
    if (!what.empty()) found.push_back(what.string());
  }
  return found;
}

int64_t MemoryOf(pid_t pid, const std::string& which) {
  std::ifstream file(ProcOf(pid) / "status");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind(which, 0) == 0) return std::atoll(line.c_str() + which.size());
  }
  return 0;
}

pid_t StartProcess(std::vector<std::string> arguments, const std::string& log) {
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  if (!log.empty()) {
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, log.c_str(),
                                     O_WRONLY | O_CREAT | O_APPEND, 0600);
  }
  // Else a socket of the test's own would stay open with the process when the test has closed it.
  posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);
  pid_t pid = 0;
  const int error =
      posix_spawn(&pid, pointers.front(), &actions, nullptr, pointers.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  return error == 0 ? pid : 0;
}

int WaitForEnd(pid_t pid) {
  int status = 0;
  while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace amhex::server
