#include "cli/connection.h"

#include <fstream>
#include <sstream>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace amhex::client {
namespace {

// Empty for an empty path.
absl::Status ReadText(const std::string& path, std::string* text) {
  if (path.empty()) return absl::OkStatus();
  // Through a stream, for the iterators of a stream's buffer throw where a folder is named.
  const std::ifstream file(path, std::ios::binary);
  std::ostringstream content;
  content << file.rdbuf();
  *text = content.str();
  if (text->empty()) {
    return absl::InvalidArgumentError(absl::StrCat(path, " cannot be read or is empty"));
  }
  return absl::OkStatus();
}

bool StaysOnThisMachine(const std::string& address) {
  return absl::StartsWith(address, "unix:") || absl::StartsWith(address, "unix-abstract:") ||
         absl::StartsWith(address, "127.") || absl::StartsWith(address, "localhost:") ||
         absl::StartsWith(address, "[::1]:");
}

absl::Status ReadSecurity(const ServerChoice& choice, Security* security) {
  security->use_tls = choice.tls || !choice.authorities.empty();
  security->server_name = choice.server_name;
  absl::Status status = ReadText(choice.authorities, &security->authorities);
  status.Update(ReadText(choice.certificate, &security->certificate));
  status.Update(ReadText(choice.key, &security->key));
  status.Update(ReadText(choice.token_file, &security->token));
  security->token = std::string(absl::StripAsciiWhitespace(security->token));
  if (status.ok() && !security->token.empty() && !security->use_tls &&
      !StaysOnThisMachine(choice.address)) {
    return absl::InvalidArgumentError(
        absl::StrCat("the token would travel to ", choice.address,
                     " in plaintext, for anybody to read; give --tls or --tls-ca"));
  }
  return status;
}

}  // namespace

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
  if (!connection.local_server) {
    const absl::Status status = ReadSecurity(choice, &connection.options.security);
    if (!status.ok()) return status;
  }
  connection.client = std::make_unique<Client>(connection.options);
  return connection;
}

}  // namespace amhex::client
