// Networks of their own for nodes, made by Linux network namespaces, so that cables can be pulled.
//
// There are two: 10.77.0.0/24 leads to the database, 10.78.0.0/24 to callers and other nodes. This
// process has the address .1 in both. Everything goes with the process.
#pragma once

#include <sys/types.h>

#include <functional>
#include <string>

namespace amhex::server {

enum class Network { kDatabase, kCallers };

// Moves this process into a fresh network namespace, before it has threads or sockets. False where
// the kernel does not permit that or has no bridges; all else that goes wrong is a failed
// expectation.
bool EnterNetworkLab();

// A place for a node, with a cable into both networks.
class LabMachine {
 public:
  // Has the address .`number` in both networks; from 2 to 254.
  explicit LabMachine(int number);
  ~LabMachine();
  LabMachine(const LabMachine&) = delete;
  LabMachine& operator=(const LabMachine&) = delete;

  // Its address among callers and nodes.
  std::string address() const;
  // For a process that is to live there: moves the thread that calls it.
  void Enter() const;
  // From now on nothing passes, and nobody is told.
  void Pull(Network network) const;
  void Plug(Network network) const;

 private:
  const int number_;
  pid_t holder_ = 0;  // keeps the namespace
  int namespace_fd_ = -1;
};

}  // namespace amhex::server
