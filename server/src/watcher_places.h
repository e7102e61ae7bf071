// With how many streams each tenant watches, over all its jobs.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "absl/status/statusor.h"

namespace amhex::server {

// Thread-safe. Outlives its places.
class WatcherPlaces {
 public:
  // One stream's; free again when it goes.
  class Place {
   public:
    ~Place();
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;

   private:
    friend class WatcherPlaces;
    Place(WatcherPlaces* places, const std::string& tenant) : places_(places), tenant_(tenant) {}

    WatcherPlaces* const places_;
    const std::string tenant_;
  };

  // RESOURCE_EXHAUSTED TOO_MANY_WATCHERS if the tenant has `most` already.
  absl::StatusOr<std::unique_ptr<Place>> Take(const std::string& tenant, int32_t most);

 private:
  std::mutex mutex_;
  std::map<std::string, int32_t> taken_;  // by tenant, those that have any
};

}  // namespace amhex::server
