#include "amhex/client.h"

#include <algorithm>

#include "absl/strings/match.h"
#include "rpc/client_implementation.h"
#include "rpc/digest.h"
#include "rpc/silence_guard.h"

namespace amhex::client {
namespace {

// Inputs up to this size travel in the SubmitJob call, if the server's limit allows.
constexpr int64_t kInlineBytes = 262'144;
// While calls wait, a connection that is silent for this long is asked whether it still carries
// anything. Servers permit it every five seconds.
constexpr int kPingMilliseconds = 10'000;
// Without an answer for this long it is given up, and its calls go on at the next address. Enough
// for answers that queue behind an upload on a slow line.
constexpr int kPingPatienceMilliseconds = 10'000;
// Enough for TLS on a slow line or a busy machine; then the next address has its turn.
constexpr int kConnectMilliseconds = 10'000;

grpc::ChannelArguments ChannelArguments() {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kPingMilliseconds);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kPingPatienceMilliseconds);
  // Whoever watches sends nothing; gRPC would stop asking after two pings.
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  // Reconnect soon after a restart of the server; Patience spaces the calls.
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  // Whatever its name says, what one attempt may take.
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kConnectMilliseconds);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 2000);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return arguments;
}

void SetDuration(absl::Duration duration, google::protobuf::Duration* proto) {
  proto->set_seconds(absl::ToInt64Seconds(duration));
  proto->set_nanos(
      static_cast<int32_t>(absl::ToInt64Nanoseconds(duration - absl::Seconds(proto->seconds()))));
}

}  // namespace

void Interrupt::Request() {
  const std::lock_guard lock(mutex_);
  requested_ = true;
  for (grpc::ClientContext* context : contexts_) context->TryCancel();
}

void Interrupt::Add(grpc::ClientContext* context) {
  const std::lock_guard lock(mutex_);
  contexts_.insert(context);
  if (requested_) context->TryCancel();
}

void Interrupt::Remove(grpc::ClientContext* context) {
  const std::lock_guard lock(mutex_);
  contexts_.erase(context);
}

std::shared_ptr<grpc::Channel> NewChannel(const ClientOptions& options) {
  const Security& security = options.security;
  grpc::ChannelArguments arguments = ChannelArguments();
  if (!security.use_tls) {
    return grpc::CreateCustomChannel(options.address, grpc::InsecureChannelCredentials(),
                                     arguments);
  }
  if (!security.server_name.empty()) {
    arguments.SetSslTargetNameOverride(security.server_name);
  }
  const grpc::SslCredentialsOptions tls{security.authorities, security.key, security.certificate};
  return grpc::CreateCustomChannel(options.address, grpc::SslCredentials(tls), arguments);
}

Client::Client(ClientOptions options)
    : implementation_(std::make_unique<Implementation>(std::move(options))) {}
Client::~Client() = default;

absl::StatusOr<v1::Capabilities> Client::GetCapabilities() {
  v1::Capabilities capabilities;
  const absl::Status status = implementation_->Call<v1::Mesher::Stub>(
      implementation_->mesher.get(), &v1::Mesher::Stub::GetCapabilities,
      v1::GetCapabilitiesRequest(), &capabilities);
  if (!status.ok()) return status;
  return capabilities;
}

v1::SubmitJobRequest Client::Implementation::NewRequest(const EncodedInput& input,
                                                        const v1::MeshingParams& params,
                                                        const SubmitOptions& submit) const {
  v1::SubmitJobRequest request;
  request.set_request_id(submit.request_id.empty() ? RandomUuid() : submit.request_id);
  *request.mutable_params() = params;
  request.set_input_encoding(input.encoding);
  request.set_priority(submit.priority);
  if (submit.run_timeout > absl::ZeroDuration()) {
    SetDuration(submit.run_timeout, request.mutable_run_timeout());
  }
  return request;
}

bool Client::Implementation::IsInline(const EncodedInput& input, const v1::Limits& limits) {
  return static_cast<int64_t>(input.bytes.size()) <=
         std::min(kInlineBytes, limits.max_inline_input_bytes());
}

absl::StatusOr<v1::Job> Client::Submit(const EncodedInput& input, const v1::MeshingParams& params,
                                       const SubmitOptions& options) {
  const absl::StatusOr<v1::Limits> limits = implementation_->GetLimits();
  if (!limits.ok()) return limits.status();
  v1::SubmitJobRequest request = implementation_->NewRequest(input, params, options);
  const bool is_inline = Implementation::IsInline(input, *limits);
  // A blob that no job uses yet may be removed between upload and submission, hence two tries.
  for (int tries_left = 1;; --tries_left) {
    if (is_inline) {
      request.set_inline_input(input.bytes);
    } else {
      const absl::StatusOr<v1::BlobRef> blob = Upload(input.bytes, options.on_upload);
      if (!blob.ok()) return blob.status();
      *request.mutable_input_blob() = *blob;
    }
    v1::SubmitJobResponse response;
    const absl::Status status = implementation_->Call<v1::Mesher::Stub>(
        implementation_->mesher.get(), &v1::Mesher::Stub::SubmitJob, request, &response);
    if (status.ok()) return response.job();
    if (ReasonOf(status) != "BLOB_MISSING" || tries_left == 0) return status;
  }
}

absl::StatusOr<v1::Job> Client::GetJob(const std::string& name) {
  v1::GetJobRequest request;
  request.set_name(FullJobName(name));
  v1::Job job;
  const absl::Status status = implementation_->Call<v1::Mesher::Stub>(
      implementation_->mesher.get(), &v1::Mesher::Stub::GetJob, request, &job);
  if (!status.ok()) return status;
  return job;
}

absl::StatusOr<std::vector<v1::Job>> Client::ListJobs(int most) {
  std::vector<v1::Job> jobs;
  v1::ListJobsRequest request;
  do {
    request.set_page_size(most - static_cast<int>(jobs.size()));
    v1::ListJobsResponse response;
    const absl::Status status = implementation_->Call<v1::Mesher::Stub>(
        implementation_->mesher.get(), &v1::Mesher::Stub::ListJobs, request, &response);
    if (!status.ok()) return status;
    jobs.insert(jobs.end(), response.jobs().begin(), response.jobs().end());
    request.set_page_token(response.next_page_token());
  } while (!request.page_token().empty() && static_cast<int>(jobs.size()) < most);
  return jobs;
}

absl::StatusOr<v1::Job> Client::CancelJob(const std::string& name) {
  v1::CancelJobRequest request;
  request.set_name(FullJobName(name));
  v1::Job job;
  const absl::Status status = implementation_->Call<v1::Mesher::Stub>(
      implementation_->mesher.get(), &v1::Mesher::Stub::CancelJob, request, &job);
  if (!status.ok()) return status;
  return job;
}

absl::Status Client::DeleteJob(const std::string& name) {
  v1::DeleteJobRequest request;
  request.set_name(FullJobName(name));
  google::protobuf::Empty nothing;
  return implementation_->Call<v1::Mesher::Stub>(implementation_->mesher.get(),
                                                 &v1::Mesher::Stub::DeleteJob, request, &nothing);
}

absl::Status Client::Implementation::WatchOnce(const std::string& name, const WatchOptions& watch,
                                               int64_t* seq, v1::Job* job, Patience* patience) {
  v1::WatchJobRequest request;
  request.set_name(name);
  request.set_after_seq(*seq);
  SetDuration(watch.min_interval, request.mutable_min_interval());
  InterruptibleCall call(options);
  const auto reader = mesher->WatchJob(call.context(), request);
  SilenceGuard silence(call.context(), options.longest_silence);
  v1::WatchJobResponse frame;
  while (reader->Read(&frame)) {
    silence.Renew();
    patience->Renew();
    *seq = frame.seq();
    if (frame.has_job()) *job = frame.job();
    if (watch.on_frame) watch.on_frame(frame);
  }
  return silence.Verdict(FromGrpcStatus(reader->Finish()));
}

absl::Status Client::Implementation::WatchOn(const std::string& name, const WatchOptions& watch,
                                             int64_t* seq, v1::Job* job) {
  Patience patience = NewPatience();
  while (true) {
    absl::Status status = WatchOnce(name, watch, seq, job, &patience);
    if (status.ok() && IsFinal(*job)) return absl::OkStatus();
    // A restarted server numbers its frames anew.
    if (absl::IsInvalidArgument(status) && *seq > 0) {
      *seq = 0;
      status = absl::UnavailableError("the frames were numbered anew");
    }
    if (status.ok()) status = absl::UnavailableError("the stream ended before the job");
    if (!patience.ShouldRetry(status)) return Named(status);
    if (watch.on_reconnect) watch.on_reconnect(status);
  }
}

absl::StatusOr<v1::Job> Client::Watch(const std::string& name, const WatchOptions& options) {
  v1::Job job;
  int64_t seq = 0;
  const absl::Status status = implementation_->WatchOn(FullJobName(name), options, &seq, &job);
  if (!status.ok()) return status;
  return job;
}

std::string FullJobName(const std::string& name) {
  return absl::StartsWith(name, "jobs/") ? name : absl::StrCat("jobs/", name);
}

}  // namespace amhex::client
