#include "store_choice.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "postgres_job_store.h"
#include "sqlite_job_store.h"
#include "status_macros.h"

namespace amhex::server {
namespace {

constexpr char kPostgresPrefixes[][16] = {"postgres://", "postgresql://"};
constexpr size_t kMaxNodeNameBytes = 64;
constexpr char kNodeNameCharacters[] =
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-_";

absl::StatusOr<UniqueFd> LockFolder(const std::string& folder, const std::string& complaint) {
  AMHEX_ASSIGN_OR_RETURN(UniqueFd lock, OpenFile(folder + "/lock", O_RDWR | O_CREAT));
  if (flock(lock.get(), LOCK_EX | LOCK_NB) != 0) return absl::FailedPreconditionError(complaint);
  return lock;
}

}  // namespace

bool IsCluster(const ServerOptions& options) {
  return std::any_of(
      std::begin(kPostgresPrefixes), std::end(kPostgresPrefixes),
      [&options](const char* prefix) { return options.store.rfind(prefix, 0) == 0; });
}

std::string AdvertisedAddress(const ServerOptions& options) {
  return options.advertise.empty() ? options.listen.front() : options.advertise;
}

absl::Status ValidateStore(const ServerOptions& options) {
  if (!IsCluster(options)) {
    if (options.store == "sqlite") return absl::OkStatus();
    // The value is not repeated: it may hold a password.
    return absl::InvalidArgumentError("--store must be sqlite or postgres://...");
  }
  if (options.ephemeral) {
    return absl::InvalidArgumentError(
        "--ephemeral forgets everything, --store postgres:// shares "
        "it; choose one");
  }
  if (options.node_name.empty() || options.node_name.size() > kMaxNodeNameBytes ||
      options.node_name.find_first_not_of(kNodeNameCharacters) != std::string::npos) {
    return absl::InvalidArgumentError(
        "--node-name must be 1 to 64 letters, digits, '.', '-' or "
        "'_', got " +
        options.node_name);
  }
  const std::string address = AdvertisedAddress(options);
  if (address.rfind("0.0.0.0:", 0) == 0 || address.rfind("[::]:", 0) == 0 ||
      address.rfind(":0") == address.size() - 2) {
    return absl::InvalidArgumentError(
        "--advertise must be the host:port where other nodes reach "
        "this one, got " +
        address);
  }
  return absl::OkStatus();
}

absl::StatusOr<StorePlaces> OpenStore(const ServerOptions& options, const std::string& folder) {
  StorePlaces places;
  if (!IsCluster(options)) {
    // Two servers on one queue would both run its jobs.
    AMHEX_ASSIGN_OR_RETURN(places.lock, LockFolder(folder, "another amhexd uses the data folder"));
    places.private_folder = folder;
    AMHEX_ASSIGN_OR_RETURN(
        places.store, SqliteJobStore::Open(options.ephemeral ? ":memory:" : folder + "/jobs.db"));
    return places;
  }
  places.private_folder = folder + "/nodes/" + options.node_name;
  AMHEX_RETURN_IF_ERROR(MakeFolders(places.private_folder));
  // Its start puts back the jobs that a node of its name runs.
  AMHEX_ASSIGN_OR_RETURN(
      places.lock,
      LockFolder(places.private_folder, "another amhexd has the --node-name " + options.node_name));
  PostgresJobStore::Options store;
  store.url = options.store;
  store.address = AdvertisedAddress(options);
  AMHEX_ASSIGN_OR_RETURN(places.store, PostgresJobStore::Open(store));
  return places;
}

}  // namespace amhex::server
