#include "request_checks.h"

#include <algorithm>
#include <charconv>
#include <set>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "convert.h"
#include "errors.h"
#include "job_id.h"
#include "sha256.h"
#include "time_convert.h"

namespace amhex::server {
namespace {

constexpr absl::Duration kMaxWatchInterval = absl::Seconds(10);
constexpr size_t kFilterDigits = 16;  // of the filters' digest, in a page token
constexpr int64_t kTokenBytes = 64;   // of a page token, at most: 16 and 19 digits in base 64

std::string Range(int64_t low, int64_t high, int64_t got) {
  return "must be in [" + std::to_string(low) + ", " + std::to_string(high) + "], got " +
         std::to_string(got);
}

bool IsWellFormed(const google::protobuf::Duration& span) {
  constexpr int64_t kMaxSeconds = 315'576'000'000;  // of google.protobuf.Duration
  constexpr int32_t kSecond = 1'000'000'000;
  return span.nanos() < kSecond && span.nanos() > -kSecond && span.seconds() <= kMaxSeconds &&
         span.seconds() >= -kMaxSeconds;
}

void CheckSpan(const std::string& field, const google::protobuf::Duration& span,
               absl::Duration longest, FieldViolations* bad) {
  if (IsWellFormed(span) && FromProto(span) > absl::ZeroDuration() && FromProto(span) <= longest) {
    return;
  }
  bad->Add(field, longest == absl::InfiniteDuration()
                      ? "must be positive"
                      : "must be in (0, " + absl::FormatDuration(longest) + "]");
}

// The engine names fields as "group.field is ..." and joins them by "; ".
void CheckParams(const amhex::v1::MeshingParams& params, FieldViolations* bad) {
  for (const auto& [field, description] : UnknownValues(params)) {
    bad->Add("params." + field, description);
  }
  const absl::Status verdict = Validate(ToEngine(params));
  if (verdict.ok()) return;
  for (const auto problem : absl::StrSplit(std::string(verdict.message()), "; ")) {
    const std::string text(problem);
    const size_t space = text.find(' ');
    bad->Add("params." + text.substr(0, space),
             space == std::string::npos ? "is not permitted" : text.substr(space + 1));
  }
}

void CheckInput(const amhex::v1::SubmitJobRequest& request, const Limits& limits,
                FieldViolations* bad) {
  if (!amhex::v1::InputEncoding_IsValid(request.input_encoding())) {
    bad->Add("input_encoding", "is no known value");
  }
  if (request.has_inline_input()) {
    const auto size = static_cast<int64_t>(request.inline_input().size());
    if (size > limits.max_inline_input_bytes) {
      bad->Add("inline_input", "has " + std::to_string(size) + " bytes; the limit is " +
                                   std::to_string(limits.max_inline_input_bytes) +
                                   "; upload it as a blob");
    }
  } else if (request.has_input_blob()) {
    if (!IsSha256Hex(request.input_blob().sha256())) {
      bad->Add("input_blob.sha256", "must be 64 lower-case hexadecimal digits");
    }
    if (request.input_blob().size_bytes() < 0) {
      bad->Add("input_blob.size_bytes", "must not be negative");
    }
  } else {
    bad->Add("input", "inline_input or input_blob is required");
  }
}

void CheckLabels(const amhex::v1::SubmitJobRequest& request, const Limits& limits,
                 FieldViolations* bad) {
  if (request.labels_size() > limits.max_label_count) {
    bad->Add("labels", "has " + std::to_string(request.labels_size()) + " entries; the limit is " +
                           std::to_string(limits.max_label_count));
  }
  const auto limit = static_cast<size_t>(limits.max_label_bytes);
  const bool fits =
      std::all_of(request.labels().begin(), request.labels().end(), [limit](const auto& label) {
        return !label.first.empty() && label.first.size() <= limit && label.second.size() <= limit;
      });
  if (!fits) {
    bad->Add("labels", "keys must have [1, " + std::to_string(limit) + "] bytes, values at most " +
                           std::to_string(limit));
  }
}

// A digest of what selects the jobs; the page's size may change between pages.
std::string FilterDigest(const amhex::v1::ListJobsRequest& request) {
  // A message can name a state millions of times.
  const std::set<int> states(request.states().begin(), request.states().end());
  std::set<std::string> parts;
  for (const int state : states) parts.insert(absl::StrCat("s", state));
  for (const auto& [key, value] : request.labels()) {
    parts.insert(absl::StrCat("l", key.size(), ":", key, value));
  }
  std::string all;
  for (const std::string& part : parts) absl::StrAppend(&all, part.size(), ":", part);
  return Sha256Hex(all).substr(0, kFilterDigits);
}

// The number in a token, or 0 if it is no token for these filters.
int64_t ReadPageToken(const amhex::v1::ListJobsRequest& request) {
  std::string plain;
  if (!absl::WebSafeBase64Unescape(request.page_token(), &plain)) return 0;
  const std::string digest = FilterDigest(request);
  if (plain.compare(0, kFilterDigits, digest) != 0) return 0;
  int64_t number = 0;
  const char* end = plain.data() + plain.size();
  const auto parsed = std::from_chars(plain.data() + kFilterDigits, end, number);
  return parsed.ec == std::errc() && parsed.ptr == end && number > 0 ? number : 0;
}

FieldViolations BadFieldsOf(const amhex::v1::SubmitJobRequest& request, const Limits& limits) {
  FieldViolations bad;
  if (!request.request_id().empty() && !IsUuid(request.request_id())) {
    bad.Add("request_id", "must be a UUID of 36 characters");
  }
  CheckParams(request.params(), &bad);
  CheckInput(request, limits, &bad);
  if (request.has_priority() && (request.priority() < 0 || request.priority() > kMaxPriority)) {
    bad.Add("priority", Range(0, kMaxPriority, request.priority()));
  }
  CheckLabels(request, limits, &bad);
  if (request.has_queue_timeout()) {
    CheckSpan("queue_timeout", request.queue_timeout(), absl::InfiniteDuration(), &bad);
  }
  if (request.has_run_timeout()) {
    CheckSpan("run_timeout", request.run_timeout(), limits.max_run_duration, &bad);
  }
  if (request.has_ttl()) {
    CheckSpan("ttl", request.ttl(), limits.max_retention_duration, &bad);
  }
  return bad;
}

}  // namespace

absl::Status CheckSubmit(const amhex::v1::SubmitJobRequest& request, const Limits& limits) {
  return BadFieldsOf(request, limits).ToStatus();
}

absl::Status CheckMeshBegin(const amhex::v1::MeshRequest& request, const Limits& limits) {
  FieldViolations bad;
  if (request.has_submit()) {
    bad.AddWithin("submit", BadFieldsOf(request.submit(), limits));
  } else {
    bad.Add("submit", "is required in the first message");
  }
  if (!request.data().empty()) bad.Add("data", "must not come in the first message");
  if (request.submit().validate_only()) {
    bad.Add("submit.validate_only", "makes no job; ask SubmitJob");
  }
  // What is to come in this stream is complete once that many bytes are there.
  if (request.submit().has_input_blob() && request.submit().input_blob().size_bytes() == 0) {
    bad.Add("submit.input_blob.size_bytes", "must be at least 1");
  }
  return bad.ToStatus();
}

absl::Status CheckWatch(const amhex::v1::WatchJobRequest& request) {
  FieldViolations bad;
  if (JobIdFromName(request.name()).empty()) bad.Add("name", "must be jobs/{uuid}");
  if (request.after_seq() < 0) bad.Add("after_seq", "must not be negative");
  const absl::Duration interval = FromProto(request.min_interval());
  if (!IsWellFormed(request.min_interval()) || interval < absl::ZeroDuration() ||
      interval > kMaxWatchInterval) {
    bad.Add("min_interval", "must be in [0, 10s]");
  }
  return bad.ToStatus();
}

absl::Status CheckBlobRef(const amhex::v1::BlobRef& blob) {
  FieldViolations bad;
  if (!IsSha256Hex(blob.sha256())) {
    bad.Add("blob.sha256", "must be 64 lower-case hexadecimal digits");
  }
  if (blob.size_bytes() < 0) bad.Add("blob.size_bytes", "must not be negative");
  return bad.ToStatus();
}

absl::Status CheckBlobToWrite(const amhex::v1::BlobRef& blob, const Limits& limits) {
  FieldViolations bad;
  if (!IsSha256Hex(blob.sha256())) {
    bad.Add("blob.sha256", "must be 64 lower-case hexadecimal digits");
  }
  if (blob.size_bytes() < 0 || blob.size_bytes() > limits.max_blob_bytes) {
    bad.Add("blob.size_bytes", Range(0, limits.max_blob_bytes, blob.size_bytes()));
  }
  return bad.ToStatus();
}

absl::Status CheckFindMissing(const amhex::v1::FindMissingBlobsRequest& request) {
  FieldViolations bad;
  if (request.blobs_size() < 1 || request.blobs_size() > kMaxFindMissingBlobs) {
    bad.Add("blobs", "must have [1, " + std::to_string(kMaxFindMissingBlobs) + "] entries, got " +
                         std::to_string(request.blobs_size()));
    return bad.ToStatus();
  }
  for (int i = 0; i < request.blobs_size(); ++i) {
    const std::string field = absl::StrCat("blobs[", i, "].");
    if (!IsSha256Hex(request.blobs(i).sha256())) {
      bad.Add(field + "sha256", "must be 64 lower-case hexadecimal digits");
    }
    if (request.blobs(i).size_bytes() < 0) bad.Add(field + "size_bytes", "must not be negative");
  }
  return bad.ToStatus();
}

absl::Status CheckRead(const amhex::v1::ReadBlobRequest& request) {
  FieldViolations bad;
  if (!IsSha256Hex(request.blob().sha256())) {
    bad.Add("blob.sha256", "must be 64 lower-case hexadecimal digits");
  }
  if (request.blob().size_bytes() < 0) bad.Add("blob.size_bytes", "must not be negative");
  if (request.offset() < 0) bad.Add("offset", "must not be negative");
  if (request.limit() < 0) bad.Add("limit", "must not be negative");
  if (request.chunk_bytes() < 0) bad.Add("chunk_bytes", "must not be negative");
  return bad.ToStatus();
}

absl::StatusOr<ByteRange> RangeToRead(const amhex::v1::ReadBlobRequest& request,
                                      int64_t blob_size) {
  if (request.offset() > blob_size) {
    return MakeError(absl::StatusCode::kOutOfRange, amhex::v1::BAD_REQUEST,
                     "offset is " + std::to_string(request.offset()) + ", but the blob has " +
                         std::to_string(blob_size) + " bytes");
  }
  const int64_t left = blob_size - request.offset();
  const int64_t wanted = request.limit() > 0 ? std::min(request.limit(), left) : left;
  return ByteRange{request.offset(), request.offset() + wanted};
}

absl::StatusOr<std::string> CheckJobName(const std::string& name) {
  const std::string id = JobIdFromName(name);
  if (!id.empty()) return id;
  FieldViolations bad;
  bad.Add("name", "must be jobs/{uuid}");
  return bad.ToStatus();
}

absl::StatusOr<JobQuery> CheckList(const amhex::v1::ListJobsRequest& request,
                                   const Limits& limits) {
  FieldViolations bad;
  JobQuery query;
  query.page_size = request.page_size() == 0 ? kDefaultPageSize : request.page_size();
  query.page_size = std::min(query.page_size, limits.max_page_size);
  query.page_bytes = limits.max_message_bytes - kTokenBytes;
  if (request.page_size() < 0) bad.Add("page_size", "must not be negative");
  if (!request.page_token().empty()) {
    query.before_number = ReadPageToken(request);
    if (query.before_number == 0) {
      bad.Add("page_token", "is not one this server gave for these filters");
    }
  }
  for (const int state : request.states()) {
    if (!amhex::v1::Job::State_IsValid(state) || state == amhex::v1::Job::STATE_UNSPECIFIED) {
      bad.Add("states", std::to_string(state) + " is no known state");
    } else if (std::count(query.states.begin(), query.states.end(), state) == 0) {
      query.states.push_back(static_cast<amhex::v1::Job::State>(state));
    }
  }
  query.labels.insert(request.labels().begin(), request.labels().end());
  if (const absl::Status verdict = bad.ToStatus(); !verdict.ok()) return verdict;
  return query;
}

std::string MakePageToken(const amhex::v1::ListJobsRequest& request, int64_t before_number) {
  return absl::WebSafeBase64Escape(FilterDigest(request) + std::to_string(before_number));
}

}  // namespace amhex::server
