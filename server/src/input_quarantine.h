// What has killed workers again and again, and is refused for a while.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace amhex::server {

// Deaths are counted by a key that equal jobs share. In memory only: a restart forgives, and each
// node of a cluster learns on its own. Thread-safe.
class InputQuarantine {
 public:
  // From `max_deaths` on a key is refused, until the last of them is `duration` ago. No duration:
  // nothing is ever refused.
  InputQuarantine(int32_t max_deaths, absl::Duration duration)
      : max_deaths_(max_deaths), duration_(duration) {}

  void NoteDeaths(const std::string& key, int32_t count, absl::Time now);
  // A job with this key has succeeded.
  void Forgive(const std::string& key);
  // FAILED_PRECONDITION INPUT_QUARANTINED, with the time that is left.
  absl::Status Check(const std::string& key, absl::Time now) const;

  // Of more keys than these the oldest are forgiven.
  static constexpr size_t kMaxKeys = 10'000;

 private:
  struct Record {
    int32_t deaths = 0;
    absl::Time last;
  };
  void ForgetOldLocked(absl::Time now);

  const int32_t max_deaths_;
  const absl::Duration duration_;
  mutable std::mutex mutex_;
  std::map<std::string, Record> records_;
};

}  // namespace amhex::server
