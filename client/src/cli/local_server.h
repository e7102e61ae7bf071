// A private amhexd for one command: own data, a unix socket, gone afterwards.
#pragma once

#include <sys/types.h>

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "amhex/client.h"

namespace amhex::client {

class LocalServer {
 public:
  // Finds amhexd (the variable AMHEXD, beside this program, in ../server, in PATH), starts it with
  // an empty data folder under TMPDIR or /tmp, and waits until it has a worker. UNAVAILABLE with
  // the end of its log if that does not come, or its worker does not start; CANCELLED if
  // interrupted.
  static absl::StatusOr<std::unique_ptr<LocalServer>> Start(Interrupt* interrupt);

  // Asks it to end, waits, ends it by force if need be, and removes the folder. Should this
  // process die first, the system ends the server.
  ~LocalServer();
  LocalServer(const LocalServer&) = delete;
  LocalServer& operator=(const LocalServer&) = delete;

  std::string address() const { return "unix:" + folder_ + "/socket"; }

 private:
  LocalServer(std::string folder, pid_t pid) : folder_(std::move(folder)), pid_(pid) {}
  absl::Status WaitUntilReady(Interrupt* interrupt);
  // The last lines of the server's log.
  std::string LogTail() const;
  bool HasEnded();

  std::string folder_;
  pid_t pid_;
  bool ended_ = false;
};

// Where amhexd is; NOT_FOUND naming the places looked at.
absl::StatusOr<std::string> FindServerProgram();

}  // namespace amhex::client
