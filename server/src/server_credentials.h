// How amhexd proves who it is, and whether callers must prove it too.
#pragma once

#include <grpcpp/security/credentials.h>
#include <grpcpp/security/server_credentials.h>

#include <memory>
#include <string>

#include "absl/status/status.h"

namespace amhex::server {

// PEM files; all empty: plaintext.
struct TlsFiles {
  std::string certificate;  // the server's, with the chain up to, not including, the root
  std::string key;
  std::string client_ca;  // callers must show a certificate of these; empty: they need none
  bool wanted() const { return !certificate.empty() || !key.empty() || !client_ca.empty(); }
};

// OK, or INVALID_ARGUMENT naming the flag: a file that is missing, not PEM, or key and certificate
// that do not belong together.
absl::Status CheckTlsFiles(const TlsFiles& files);
// The same for the authorities of other nodes; empty is OK.
absl::Status CheckPeerCa(const std::string& path);

// The files are looked at again every few seconds; new connections use the new ones. Replace key
// and certificate together, by renaming their folder or a link to it.
std::shared_ptr<grpc::ServerCredentials> MakeServerCredentials(const TlsFiles& files);

// How this server calls others: their certificates must come from the authorities in `peer_ca`, and
// it shows its own where callers must show theirs. The files are looked at again as above.
std::shared_ptr<grpc::ChannelCredentials> MakePeerCredentials(const std::string& peer_ca,
                                                              const TlsFiles& own);

}  // namespace amhex::server
