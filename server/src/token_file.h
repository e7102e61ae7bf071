// The file that says who may call: one line per token.
//
//   # tenant  roles        SHA-256 of the token  bounds (optional)
//   ada       submit,read  9f86d081884c7d65...   weight=2 max_queued=100 max_running=4
//
// Roles: submit, read, read-all, admin. Bounds: weight, max_queued, max_running, max_blob_bytes. A
// tenant may have several tokens. The file holds digests only; tokens are long random words (see
// NewToken), so that a digest does not give them away.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "caller.h"

namespace amhex::server {

class TokenTable {
 public:
  // INVALID_ARGUMENT naming the line and what is wrong with it.
  static absl::StatusOr<TokenTable> Parse(const std::string& text);

  // Whose token it is; null if nobody's. Takes the same time for every token of a length.
  const Caller* Find(const std::string& token) const;
  size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    std::string digest;  // 64 lower-case hexadecimal digits
    Caller caller;
  };
  std::vector<Entry> entries_;
};

// A fresh token: 256 random bits as text.
std::string NewToken();

// [a-z0-9][a-z0-9._-]*, at most 64 bytes.
bool IsTenantName(const std::string& name);

}  // namespace amhex::server
