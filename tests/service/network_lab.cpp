#include "network_lab.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "absl/strings/str_cat.h"

namespace amhex::server {
namespace {

bool Run(const std::string& command) {
  return std::system(absl::StrCat(command, " 2>/dev/null").c_str()) == 0;
}

std::string NameOf(Network network) {
  return network == Network::kDatabase ? "database" : "callers";
}

std::string AddressIn(Network network, int number) {
  return absl::StrCat(network == Network::kDatabase ? "10.77.0." : "10.78.0.", number);
}

// The end of the cable that stays with this process.
std::string CableOf(Network network, int number) { return absl::StrCat(NameOf(network), number); }

}  // namespace

bool EnterNetworkLab() {
  if (unshare(CLONE_NEWNET) != 0) {
    EXPECT_EQ(errno, EPERM) << std::strerror(errno);
    return false;
  }
  EXPECT_TRUE(Run("ip link set lo up")) << "iproute2 is missing";
  for (const Network network : {Network::kDatabase, Network::kCallers}) {
    const std::string name = NameOf(network);
    // What is permitted by then may still be unknown to the kernel: it may have no bridges.
    if (!Run("ip link add " + name + " type bridge")) return false;
    EXPECT_TRUE(Run(absl::StrCat("ip addr add ", AddressIn(network, 1), "/24 dev ", name)));
    EXPECT_TRUE(Run("ip link set " + name + " up"));
  }
  return true;
}

LabMachine::LabMachine(int number) : number_(number) {
  int ready[2];
  EXPECT_EQ(pipe2(ready, O_CLOEXEC), 0);
  holder_ = fork();
  if (holder_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const char done = unshare(CLONE_NEWNET) == 0 ? 1 : 0;
    if (write(ready[1], &done, 1) == 1) pause();
    _exit(EXIT_FAILURE);
  }
  char done = 0;
  EXPECT_EQ(read(ready[0], &done, 1), 1);
  EXPECT_EQ(done, 1);
  close(ready[0]);
  close(ready[1]);
  const std::string space = absl::StrCat("/proc/", holder_, "/ns/net");
  namespace_fd_ = open(space.c_str(), O_RDONLY | O_CLOEXEC);
  const std::string inside = "nsenter --net=" + space + " ip ";
  EXPECT_TRUE(Run(inside + "link set lo up"));
  for (const Network network : {Network::kDatabase, Network::kCallers}) {
    const std::string name = NameOf(network);
    const std::string cable = CableOf(network, number);
    EXPECT_TRUE(Run(
        absl::StrCat("ip link add ", cable, " type veth peer name ", name, " netns ", holder_)));
    EXPECT_TRUE(Run("ip link set " + cable + " master " + name + " up"));
    EXPECT_TRUE(
        Run(absl::StrCat(inside, "addr add ", AddressIn(network, number), "/24 dev ", name)));
    EXPECT_TRUE(Run(inside + "link set " + name + " up"));
  }
}

LabMachine::~LabMachine() {
  // A namespace goes at some time after its last process, and its cables with it; their names are
  // needed again at once.
  for (const Network network : {Network::kDatabase, Network::kCallers}) {
    EXPECT_TRUE(Run("ip link del " + CableOf(network, number_)));
  }
  close(namespace_fd_);
  kill(holder_, SIGKILL);
  waitpid(holder_, nullptr, 0);
}

std::string LabMachine::address() const { return AddressIn(Network::kCallers, number_); }

void LabMachine::Enter() const {
  if (setns(namespace_fd_, CLONE_NEWNET) != 0) _exit(EXIT_FAILURE);
}

void LabMachine::Pull(Network network) const {
  EXPECT_TRUE(Run("ip link set " + CableOf(network, number_) + " down"));
}

void LabMachine::Plug(Network network) const {
  EXPECT_TRUE(Run("ip link set " + CableOf(network, number_) + " up"));
}

}  // namespace amhex::server
