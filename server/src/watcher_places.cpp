#include "watcher_places.h"

#include "amhex/v1/errors.pb.h"
#include "errors.h"

namespace amhex::server {

WatcherPlaces::Place::~Place() {
  std::lock_guard<std::mutex> lock(places_->mutex_);
  const auto own = places_->taken_.find(tenant_);
  if (--own->second == 0) places_->taken_.erase(own);
}

absl::StatusOr<std::unique_ptr<WatcherPlaces::Place>> WatcherPlaces::Take(const std::string& tenant,
                                                                          int32_t most) {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto own = taken_.find(tenant);
  if (own != taken_.end() && own->second >= most) {
    return MakeError(
        absl::StatusCode::kResourceExhausted, amhex::v1::TOO_MANY_WATCHERS,
        "the tenant watches with " + std::to_string(most) + " streams, which is the limit");
  }
  ++taken_[tenant];
  return std::unique_ptr<Place>(new Place(this, tenant));
}

}  // namespace amhex::server
