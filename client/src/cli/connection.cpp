#include "cli/connection.h"

namespace amhex::client {

absl::StatusOr<Connection> Connect(const ServerChoice& choice, Interrupt* interrupt) {
  Connection connection;
  connection.options.address = choice.address;
  connection.options.patience = absl::Seconds(choice.patience_seconds);
  connection.options.interrupt = interrupt;
  if (choice.local || choice.address.empty()) {
    absl::StatusOr<std::unique_ptr<LocalServer>> server = LocalServer::Start(interrupt);
    if (!server.ok()) return server.status();
    connection.local_server = std::move(*server);
    connection.options.address = connection.local_server->address();
    // It runs on this machine; if it is gone, it will not come back.
    connection.options.patience = absl::Seconds(5);
  }
  connection.client = std::make_unique<Client>(connection.options);
  return connection;
}

}  // namespace amhex::client
