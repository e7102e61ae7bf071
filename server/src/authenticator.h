// Tells who makes a call, from its bearer token or its client certificate.
#pragma once

#include <grpcpp/grpcpp.h>

#include <initializer_list>
#include <memory>
#include <mutex>
#include <string>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "caller.h"
#include "token_file.h"

namespace amhex::server {

// Thread-safe.
class Authenticator {
 public:
  enum class Mode {
    kNobodyAsked,   // every caller is Everyone()
    kCertificates,  // the common name of the client's certificate is the tenant
    kTokens,        // the header "authorization: Bearer TOKEN" names a line of the token file
  };

  // Reads `token_file` in mode kTokens; INVALID_ARGUMENT naming what is wrong with it.
  static absl::StatusOr<std::unique_ptr<Authenticator>> Create(Mode mode,
                                                               const std::string& token_file);

  // The caller, who has at least one of the roles `needed`. UNAUTHENTICATED NOT_AUTHENTICATED,
  // PERMISSION_DENIED ROLE_MISSING.
  absl::StatusOr<Caller> Identify(const grpc::ServerContextBase& context,
                                  std::initializer_list<Role> needed);

 private:
  Authenticator(Mode mode, std::string token_file)
      : mode_(mode), token_file_(std::move(token_file)) {}

  absl::StatusOr<Caller> CallerOf(const grpc::ServerContextBase& context);
  // The table in force; looks for a newer file once a second. A file that is gone or wrong leaves
  // the last good one in force, and is logged.
  std::shared_ptr<const TokenTable> Table();

  // What tells one state of a file from another.
  struct FileStamp {
    int64_t modified_nanos = 0;
    int64_t size = 0;
    uint64_t inode = 0;
    bool operator==(const FileStamp&) const = default;
  };
  static FileStamp StampOf(const std::string& path);

  const Mode mode_;
  const std::string token_file_;
  std::mutex mutex_;
  std::shared_ptr<const TokenTable> table_;
  FileStamp stamp_;
  absl::Time next_look_ = absl::InfinitePast();
};

}  // namespace amhex::server
