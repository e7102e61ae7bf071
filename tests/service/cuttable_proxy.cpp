#include "cuttable_proxy.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "absl/time/clock.h"

namespace amhex::server {
namespace {

constexpr int kPollMilliseconds = 20;

sockaddr_in SocketAddress(const std::string& host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  inet_pton(AF_INET, host.c_str(), &address.sin_addr);
  address.sin_port = htons(static_cast<uint16_t>(port));
  return address;
}

bool WaitReadable(int fd) {
  pollfd entry{fd, POLLIN, 0};
  return poll(&entry, 1, kPollMilliseconds) > 0;
}

}  // namespace

int ConnectToPort(const std::string& host, int port) {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  const sockaddr_in address = SocketAddress(host, port);
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) return fd;
  close(fd);
  return -1;
}

CuttableProxy::CuttableProxy(const std::string& target_host, int target_port)
    : target_host_(target_host), target_port_(target_port) {
  listener_ = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = SocketAddress("127.0.0.1", 0);
  socklen_t size = sizeof(address);
  const bool is_listening = bind(listener_, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
                            listen(listener_, 64) == 0;
  EXPECT_TRUE(is_listening) << std::generic_category().message(errno);
  getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
  port_ = ntohs(address.sin_port);
  threads_.emplace_back([this] { Serve(); });
}

CuttableProxy::~CuttableProxy() {
  stopping_ = true;
  threads_.front().join();
  for (size_t i = 1; i < threads_.size(); ++i) threads_[i].join();
  close(listener_);
}

void CuttableProxy::Mend() {
  // Connections of before the cut have lost their place; they break.
  ++generation_;
  cut_ = false;
}

void CuttableProxy::Serve() {
  while (!stopping_) {
    if (cut_ || !WaitReadable(listener_)) {
      if (cut_) absl::SleepFor(absl::Milliseconds(kPollMilliseconds));
      continue;
    }
    const int client = accept(listener_, nullptr, nullptr);
    const int target = ConnectToPort(target_host_, target_port_);
    if (target < 0) {
      close(client);
      continue;
    }
    const int64_t generation = generation_;
    threads_.emplace_back([this, client, target, generation] {
      std::thread back([=, this] { Pass(target, client, generation); });
      Pass(client, target, generation);
      back.join();
      close(client);
      close(target);
    });
  }
}

void CuttableProxy::Pass(int from, int to, int64_t generation) {
  char bytes[65536];
  while (!stopping_ && generation == generation_) {
    if (cut_) {
      absl::SleepFor(absl::Milliseconds(kPollMilliseconds));
      continue;
    }
    if (!WaitReadable(from)) continue;
    const ssize_t got = recv(from, bytes, sizeof(bytes), 0);
    if (got <= 0 || send(to, bytes, static_cast<size_t>(got), MSG_NOSIGNAL) != got) break;
  }
  shutdown(from, SHUT_RDWR);
  shutdown(to, SHUT_RDWR);
}

}  // namespace amhex::server
