#include "errors.h"

#include <utility>

#include "absl/strings/cord.h"
#include "google/rpc/error_details.pb.h"
#include "time_convert.h"

namespace amhex::server {
namespace {

constexpr char kTypePrefix[] = "type.googleapis.com/";
// gRPC refuses to send trailers beyond 8 KiB by default; messages leave room for the details.
constexpr size_t kMaxMessageBytes = 2048;
constexpr absl::Duration kQuotaRetryDelay = absl::Seconds(10);
constexpr size_t kMaxViolations = 24;
constexpr size_t kMaxDescriptionBytes = 128;

template <class Detail>
std::string TypeUrl() {
  return kTypePrefix + Detail::descriptor()->full_name();
}

template <class Detail>
void Attach(const Detail& detail, absl::Status* error) {
  error->SetPayload(TypeUrl<Detail>(), absl::Cord(detail.SerializeAsString()));
}

std::string Bounded(const std::string& message) {
  if (message.size() <= kMaxMessageBytes) return message;
  return message.substr(0, kMaxMessageBytes) + " [cut]";
}

google::rpc::ErrorInfo MakeInfo(amhex::v1::ErrorReason reason) {
  google::rpc::ErrorInfo info;
  info.set_reason(amhex::v1::ErrorReason_Name(reason));
  info.set_domain(kErrorDomain);
  return info;
}

}  // namespace

absl::Status MakeError(absl::StatusCode code, amhex::v1::ErrorReason reason,
                       const std::string& message,
                       const std::map<std::string, std::string>& metadata) {
  absl::Status error(code, Bounded(message));
  google::rpc::ErrorInfo info = MakeInfo(reason);
  info.mutable_metadata()->insert(metadata.begin(), metadata.end());
  Attach(info, &error);
  return error;
}

absl::Status WithRetryDelay(absl::Status error, absl::Duration delay) {
  google::rpc::RetryInfo retry;
  *retry.mutable_retry_delay() = ToProto(delay);
  Attach(retry, &error);
  return error;
}

absl::Status WithPrecondition(absl::Status error, const std::string& type,
                              const std::string& subject) {
  google::rpc::PreconditionFailure failure;
  auto* violation = failure.add_violations();
  violation->set_type(type);
  violation->set_subject(subject);
  violation->set_description(std::string(error.message()));
  Attach(failure, &error);
  return error;
}

absl::Status QuotaExceeded(const std::string& what, int64_t limit) {
  const std::string message = "the tenant may have " + std::to_string(limit) + " " + what;
  google::rpc::QuotaFailure failure;
  auto* violation = failure.add_violations();
  violation->set_subject(what);
  violation->set_description(message);
  absl::Status error =
      MakeError(absl::StatusCode::kResourceExhausted, amhex::v1::QUOTA_EXCEEDED, message);
  Attach(failure, &error);
  return WithRetryDelay(std::move(error), kQuotaRetryDelay);
}

absl::Status ServerFault(const std::string& message) {
  return MakeError(absl::StatusCode::kInternal, amhex::v1::SERVER_FAULT, message);
}

std::string ReasonOf(const absl::Status& error) {
  const auto payload = error.GetPayload(TypeUrl<google::rpc::ErrorInfo>());
  google::rpc::ErrorInfo info;
  if (!payload || !info.ParseFromString(std::string(*payload))) return "";
  return info.reason();
}

std::string ReasonOf(const google::rpc::Status& error) { return ReasonOf(FromRpcStatus(error)); }

google::rpc::Status ToRpcStatus(const absl::Status& error) {
  google::rpc::Status out;
  out.set_code(static_cast<int>(error.code()));
  out.set_message(Bounded(std::string(error.message())));
  error.ForEachPayload([&out](absl::string_view type_url, const absl::Cord& payload) {
    auto* detail = out.add_details();
    detail->set_type_url(std::string(type_url));
    detail->set_value(std::string(payload));
  });
  if (!error.ok() && ReasonOf(error).empty()) {
    out.add_details()->PackFrom(MakeInfo(amhex::v1::SERVER_FAULT));
  }
  return out;
}

absl::Status FromRpcStatus(const google::rpc::Status& error) {
  absl::Status out(static_cast<absl::StatusCode>(error.code()), error.message());
  for (const auto& detail : error.details()) {
    out.SetPayload(detail.type_url(), absl::Cord(detail.value()));
  }
  return out;
}

void FieldViolations::Add(const std::string& field, const std::string& description) {
  if (violations_.size() >= kMaxViolations) return;
  violations_.push_back(
      {field.substr(0, kMaxDescriptionBytes), description.substr(0, kMaxDescriptionBytes)});
}

void FieldViolations::AddWithin(const std::string& field, const FieldViolations& inner) {
  for (const Violation& violation : inner.violations_) {
    Add(field + "." + violation.field, violation.description);
  }
}

absl::Status FieldViolations::ToStatus() const {
  if (violations_.empty()) return absl::OkStatus();
  google::rpc::BadRequest bad;
  std::string message;
  for (const Violation& violation : violations_) {
    auto* entry = bad.add_field_violations();
    entry->set_field(violation.field);
    entry->set_description(violation.description);
    if (!message.empty()) message += "; ";
    message += violation.field + ": " + violation.description;
  }
  absl::Status error =
      MakeError(absl::StatusCode::kInvalidArgument, amhex::v1::BAD_REQUEST, message);
  Attach(bad, &error);
  return error;
}

}  // namespace amhex::server
