// Where a command finds its server: the one named, or a private one.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "amhex/client.h"
#include "cli/local_server.h"

namespace amhex::client {

struct ServerChoice {
  std::string address;  // --server or AMHEX_SERVER; empty = a private server
  bool local = false;   // --local: a private server whatever AMHEX_SERVER says
  double patience_seconds = 60;
  bool tls = false;         // --tls
  std::string authorities;  // --tls-ca FILE; implies --tls
  std::string certificate;  // --tls-cert FILE
  std::string key;          // --tls-key FILE
  std::string server_name;  // --tls-name
  std::string token_file;   // --token-file or AMHEX_TOKEN_FILE
};

// A client, and the private server it talks to, if that is what was chosen.
struct Connection {
  std::unique_ptr<LocalServer> local_server;
  std::unique_ptr<Client> client;
  ClientOptions options;
};

absl::StatusOr<Connection> Connect(const ServerChoice& choice, Interrupt* interrupt);

}  // namespace amhex::client
