// gRPC and google.rpc statuses as absl statuses that keep their google.rpc details.
#pragma once

#include <grpcpp/support/status.h>

#include <optional>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "google/rpc/status.pb.h"

namespace amhex::client {

// Bad fields are appended to the message, so that it says everything.
absl::Status FromGrpcStatus(const grpc::Status& status);
absl::Status FromRpcStatus(const google::rpc::Status& status);

// When the server advises to repeat the call.
std::optional<absl::Duration> RetryDelayOf(const absl::Status& status);

// True if the server's transport has ended the call because its memory for messages was full. The
// service's own RESOURCE_EXHAUSTED have a reason, and a message that is too long for either side
// stays too long.
bool HasNoRoomNow(const absl::Status& status);

// ErrorInfo.metadata[key], or "".
std::string MetadataOf(const absl::Status& status, const std::string& key);

}  // namespace amhex::client
