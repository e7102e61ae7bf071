// Trouble on the way between two processes of this machine.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

namespace amhex::server {

// Passes TCP connections on to an address of this machine, until it is cut off.
class CuttableProxy {
 public:
  CuttableProxy(const std::string& target_host, int target_port);
  ~CuttableProxy();

  int port() const { return port_; }
  // While cut, nothing passes and nothing is refused: packets seem to be lost.
  void Cut() { cut_ = true; }
  // Breaks all connections and lets new ones through; also without a cut before.
  void Mend();

 private:
  void Serve();
  void Pass(int from, int to, int64_t generation);

  const std::string target_host_;
  const int target_port_;
  int listener_ = -1;
  int port_ = 0;
  std::atomic<bool> cut_{false};
  std::atomic<bool> stopping_{false};
  std::atomic<int64_t> generation_{0};
  std::vector<std::thread> threads_;
};

// A connected socket, or -1.
int ConnectToPort(const std::string& host, int port);

}  // namespace amhex::server
