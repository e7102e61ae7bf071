// amhexd assembled: stores, manager, workers, services, health, reflection, metrics page.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "server_options.h"

namespace amhex::server {

class JobManager;
class WorkerPool;

class Server {
 public:
  // Serves when it returns; the workers come up in the background. FAILED_PRECONDITION when another
  // server uses the data folder, UNAVAILABLE when an address cannot be had.
  static absl::StatusOr<std::unique_ptr<Server>> Create(const ServerOptions& options);
  // The checks of Create that need no folder and no address: options, certificates, tokens.
  static absl::Status Check(const ServerOptions& options);
  ~Server();  // as Stop(absl::Now()) if it was not stopped

  // What was bound, with the real ports, in the order of ServerOptions::listen.
  const std::vector<std::string>& addresses() const;
  // host:port of the Prometheus page, or empty.
  const std::string& metrics_address() const;

  // Refuses new work, lets running jobs finish until `deadline`, gives the rest back to the queue,
  // ends all streams, and returns when nothing runs any more. From a second thread, brings the
  // deadline forward.
  void Stop(absl::Time deadline);

  // For tests.
  JobManager& manager();
  WorkerPool& pool();

 private:
  struct Parts;
  explicit Server(std::unique_ptr<Parts> parts);

  std::unique_ptr<Parts> parts_;
};

}  // namespace amhex::server
