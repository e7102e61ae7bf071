// Which store an amhexd keeps its queue in, and what that means for its folder.
#pragma once

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "files.h"
#include "job_store.h"
#include "server_options.h"

namespace amhex::server {

struct StorePlaces {
  std::unique_ptr<JobStore> store;
  // Where this server alone works; holds what uploads and workers have not finished.
  std::string private_folder;
  // Held while the server runs.
  UniqueFd lock;
};

// True when other servers share the queue and the data folder.
bool IsCluster(const ServerOptions& options);
// Where other nodes reach this one.
std::string AdvertisedAddress(const ServerOptions& options);
// INVALID_ARGUMENT naming the flag.
absl::Status ValidateStore(const ServerOptions& options);

// Opens the store. `folder` exists. FAILED_PRECONDITION when another server uses the folder, or
// one of the same name the cluster's.
absl::StatusOr<StorePlaces> OpenStore(const ServerOptions& options, const std::string& folder);

}  // namespace amhex::server
