// Errors with google.rpc details. Inside the server an error is an absl::Status whose payloads are
// the details; it becomes a call's status (grpc_status.h) or a job's (ToRpcStatus).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "amhex/v1/errors.pb.h"
#include "google/rpc/status.pb.h"

namespace amhex::server {

inline constexpr char kErrorDomain[] = "amhex";

// An error of `code` whose ErrorInfo names `reason`. `message` must hold no path, pointer or SQL.
absl::Status MakeError(absl::StatusCode code, amhex::v1::ErrorReason reason,
                       const std::string& message,
                       const std::map<std::string, std::string>& metadata = {});

// The same, with advice when to repeat the call.
absl::Status WithRetryDelay(absl::Status error, absl::Duration delay);

// The same, with a PreconditionFailure of the given type and subject.
absl::Status WithPrecondition(absl::Status error, const std::string& type,
                              const std::string& subject);

// RESOURCE_EXHAUSTED QUOTA_EXCEEDED: a tenant has `limit` of `what` already.
absl::Status QuotaExceeded(const std::string& what, int64_t limit);

// A fault of the server itself; `message` is logged by the caller, not shown.
absl::Status ServerFault(const std::string& message);

// The name of the reason in `error`'s ErrorInfo, or "" if it has none.
std::string ReasonOf(const absl::Status& error);
std::string ReasonOf(const google::rpc::Status& error);

// Code, message and details; an error without ErrorInfo gets SERVER_FAULT.
google::rpc::Status ToRpcStatus(const absl::Status& error);
absl::Status FromRpcStatus(const google::rpc::Status& error);

// Collects every bad field of a request (as many as fit into an answer's trailers).
class FieldViolations {
 public:
  void Add(const std::string& field, const std::string& description);
  // Those of a message that stands in `field`.
  void AddWithin(const std::string& field, const FieldViolations& inner);
  bool empty() const { return violations_.empty(); }

  // OK, or INVALID_ARGUMENT with one BadRequest that names all fields.
  absl::Status ToStatus() const;

 private:
  struct Violation {
    std::string field;
    std::string description;
  };
  std::vector<Violation> violations_;
};

}  // namespace amhex::server
