#include "latest_shown.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

namespace amhex::server {
namespace {

// A worker is lost between the look of one who saw it and the moment when that one shows it.
TEST(LatestShown, LookThatLingersDoesNotHideWhatChangedMeanwhile) {
  std::atomic<bool> serving = true;
  std::atomic<bool> has_looked = false;
  std::atomic<bool> shown = false;
  LatestShown<bool> health(
      [&] {
        const bool state = serving;
        if (!has_looked.exchange(true)) std::this_thread::sleep_for(std::chrono::milliseconds(50));
        return state;
      },
      [&](bool state) { shown = state; });
  std::thread slow([&] { health.Refresh(); });
  while (!has_looked) std::this_thread::yield();
  serving = false;
  health.Refresh();
  slow.join();
  EXPECT_FALSE(shown);
}

TEST(LatestShown, ShowsTheLastOfManyChanges) {
  std::atomic<int> ready = 0;
  std::atomic<int> shown = 0;
  LatestShown<int> health([&] { return ready.load(); }, [&](int state) { shown = state; });
  std::vector<std::thread> workers;
  for (int i = 0; i < 4; ++i) {
    workers.emplace_back([&] {
      for (int change = 0; change < 1000; ++change) {
        ++ready;
        health.Refresh();
      }
    });
  }
  for (std::thread& worker : workers) worker.join();
  EXPECT_EQ(shown, 4000);
}

}  // namespace
}  // namespace amhex::server
