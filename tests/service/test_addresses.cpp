#include "test_addresses.h"

#include <unistd.h>

#include <atomic>

namespace amhex::server {
namespace {

std::string AddressOfThisProcess() {
  const auto pid = static_cast<unsigned>(getpid());  // less than 2^22
  return "127." + std::to_string(1 + (pid >> 16)) + "." + std::to_string((pid >> 8) & 255) + "." +
         std::to_string(pid & 255);
}

std::string& Chosen() {
  static std::string address = AddressOfThisProcess();
  return address;
}

}  // namespace

std::string OwnAddress() { return Chosen(); }
void SetOwnAddress(const std::string& address) { Chosen() = address; }

int NextPort() {
  constexpr int kFirst = 10'000;  // below those that the kernel gives to outgoing connections
  static std::atomic<int> count{0};
  return kFirst + count++;
}

}  // namespace amhex::server
