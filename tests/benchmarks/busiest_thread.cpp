#include "busiest_thread.h"

#include <dirent.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>

#include "absl/time/clock.h"

namespace amhex::server {
namespace {

constexpr absl::Duration kInterval = absl::Milliseconds(2);

// CPU seconds of a thread so far; negative if it has ended. The clock's number is that of the
// kernel's interface: the complement of the thread's, then 1 for “per thread”, 2 for “as
// scheduled”.
double CpuSecondsOf(int thread) {
  const auto clock = static_cast<clockid_t>((~static_cast<unsigned>(thread) << 3) | 6U);
  timespec time{};
  if (clock_gettime(clock, &time) != 0) return -1;
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace

BusiestThread::BusiestThread() {
  Look(true);
  looking_ = std::thread([this] {
    while (!stop_) {
      absl::SleepFor(kInterval);
      Look(false);
    }
  });
}

BusiestThread::~BusiestThread() { Stop(); }

double BusiestThread::Stop() {
  if (looking_.joinable()) {
    stop_ = true;
    looking_.join();  // which looks once more
  }
  double most = 0;
  for (const auto& [thread, seconds] : threads_) {
    most = std::max(most, seconds.last - seconds.first);
  }
  return most;
}

void BusiestThread::Look(bool is_first) {
  DIR* folder = opendir("/proc/self/task");
  if (folder == nullptr) return;
  while (const dirent* entry = readdir(folder)) {
    const int thread = std::atoi(entry->d_name);
    if (thread == 0) continue;  // "." and ".."
    const double seconds = CpuSecondsOf(thread);
    if (seconds < 0) continue;
    // A thread that was not there at first has done all its work since.
    Seconds& known = threads_.try_emplace(thread, Seconds{is_first ? seconds : 0, 0}).first->second;
    known.last = seconds;
  }
  closedir(folder);
}

}  // namespace amhex::server
