#include "input_quarantine.h"

#include <algorithm>

#include "amhex/v1/errors.pb.h"
#include "errors.h"

namespace amhex::server {

void InputQuarantine::ForgetOldLocked(absl::Time now) {
  for (auto entry = records_.begin(); entry != records_.end();) {
    entry = entry->second.last + duration_ <= now ? records_.erase(entry) : std::next(entry);
  }
  if (records_.size() <= kMaxKeys) return;
  records_.erase(std::min_element(
      records_.begin(), records_.end(),
      [](const auto& left, const auto& right) { return left.second.last < right.second.last; }));
}

void InputQuarantine::NoteDeaths(const std::string& key, int32_t count, absl::Time now) {
  if (duration_ <= absl::ZeroDuration()) return;
  std::lock_guard<std::mutex> lock(mutex_);
  ForgetOldLocked(now);
  Record& record = records_[key];
  record.deaths += count;
  record.last = now;
  ForgetOldLocked(now);
}

void InputQuarantine::Forgive(const std::string& key) {
  std::lock_guard<std::mutex> lock(mutex_);
  records_.erase(key);
}

absl::Status InputQuarantine::Check(const std::string& key, absl::Time now) const {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto found = records_.find(key);
  if (found == records_.end() || found->second.deaths < max_deaths_) return absl::OkStatus();
  const absl::Duration left = found->second.last + duration_ - now;
  if (left <= absl::ZeroDuration()) return absl::OkStatus();
  return WithRetryDelay(
      MakeError(absl::StatusCode::kFailedPrecondition, amhex::v1::INPUT_QUARANTINED,
                "jobs with this input and these parameters have killed " +
                    std::to_string(found->second.deaths) + " workers, and are refused for " +
                    absl::FormatDuration(absl::Ceil(left, absl::Seconds(1)))),
      left);
}

}  // namespace amhex::server
