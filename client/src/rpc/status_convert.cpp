#include "rpc/status_convert.h"

#include "absl/strings/cord.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "amhex/client.h"
#include "google/rpc/error_details.pb.h"

namespace amhex::client {
namespace {

constexpr char kErrorInfoUrl[] = "type.googleapis.com/google.rpc.ErrorInfo";
constexpr char kRetryInfoUrl[] = "type.googleapis.com/google.rpc.RetryInfo";
constexpr char kBadRequestUrl[] = "type.googleapis.com/google.rpc.BadRequest";

template <class Message>
std::optional<Message> DetailOf(const absl::Status& status, const char* url) {
  const absl::optional<absl::Cord> payload = status.GetPayload(url);
  Message message;
  if (!payload || !message.ParseFromString(std::string(*payload))) return std::nullopt;
  return message;
}

// Fields that the message does not mention yet.
std::string WithBadFields(std::string message, const google::rpc::BadRequest& bad_request) {
  for (const auto& violation : bad_request.field_violations()) {
    if (message.find(violation.description()) != std::string::npos) continue;
    absl::StrAppend(&message, message.empty() ? "" : "; ", violation.field(), ": ",
                    violation.description());
  }
  return message;
}

}  // namespace

absl::Status FromRpcStatus(const google::rpc::Status& status) {
  std::string message = status.message();
  for (const auto& detail : status.details()) {
    google::rpc::BadRequest bad_request;
    if (detail.type_url() == kBadRequestUrl && bad_request.ParseFromString(detail.value())) {
      message = WithBadFields(std::move(message), bad_request);
    }
  }
  absl::Status converted(static_cast<absl::StatusCode>(status.code()), message);
  for (const auto& detail : status.details()) {
    converted.SetPayload(detail.type_url(), absl::Cord(detail.value()));
  }
  return converted;
}

absl::Status FromGrpcStatus(const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  google::rpc::Status rpc_status;
  if (!rpc_status.ParseFromString(status.error_details())) rpc_status.Clear();
  rpc_status.set_code(status.error_code());
  rpc_status.set_message(status.error_message());
  return FromRpcStatus(rpc_status);
}

std::optional<absl::Duration> RetryDelayOf(const absl::Status& status) {
  const auto info = DetailOf<google::rpc::RetryInfo>(status, kRetryInfoUrl);
  if (!info) return std::nullopt;
  return absl::Seconds(info->retry_delay().seconds()) +
         absl::Nanoseconds(info->retry_delay().nanos());
}

bool HasNoRoomNow(const absl::Status& status) {
  if (!absl::IsResourceExhausted(status) || !ReasonOf(status).empty()) return false;
  // gRPC tells only in words that a message ("larger than max") or metadata ("exceeds limit") are
  // longer than the receiver takes.
  return !absl::StrContains(status.message(), "larger than max") &&
         !absl::StrContains(status.message(), "exceeds limit");
}

std::string MetadataOf(const absl::Status& status, const std::string& key) {
  const auto info = DetailOf<google::rpc::ErrorInfo>(status, kErrorInfoUrl);
  if (!info) return "";
  const auto place = info->metadata().find(key);
  return place == info->metadata().end() ? "" : place->second;
}

std::string ReasonOf(const absl::Status& status) {
  const auto info = DetailOf<google::rpc::ErrorInfo>(status, kErrorInfoUrl);
  return info ? info->reason() : "";
}

absl::Status ErrorOf(const amhex::v1::Job& job) {
  return job.has_error() ? FromRpcStatus(job.error()) : absl::OkStatus();
}

}  // namespace amhex::client
