#include "job_manager.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "errors.h"
#include "google/protobuf/io/coded_stream.h"
#include "google/protobuf/io/zero_copy_stream_impl_lite.h"
#include "input_preflight.h"
#include "job.h"
#include "job_id.h"
#include "logging.h"
#include "status_macros.h"
#include "time_convert.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

// Enough of an input to reach its counts, unless it carries much metadata.
constexpr size_t kPreflightBytes = 64 * 1024;
constexpr absl::Duration kDrainRetryDelay = absl::Seconds(5);

// A digest of the request without its request_id; equal requests give equal digests.
std::string RequestHash(const amhex::v1::SubmitJobRequest& request,
                        const amhex::v1::BlobRef& input) {
  amhex::v1::SubmitJobRequest canonical = request;
  canonical.clear_request_id();
  *canonical.mutable_input_blob() = input;
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    canonical.SerializeToCodedStream(&coded);
  }
  return Sha256Hex(bytes);
}

FinalOutcome Outcome(Job::State state, const absl::Status& error) {
  FinalOutcome outcome;
  outcome.state = state;
  *outcome.details.mutable_error() = ToRpcStatus(error);
  return outcome;
}

FinalOutcome CancelledOutcome() {
  return Outcome(Job::CANCELLED,
                 MakeError(absl::StatusCode::kCancelled, amhex::v1::CANCEL_REQUESTED,
                           "the job was cancelled on request"));
}

}  // namespace

Attempt::Attempt(ClaimedJob claimed, std::shared_ptr<JobFeed> feed, std::string work_path)
    : claimed_(std::move(claimed)),
      feed_(std::move(feed)),
      work_path_(std::move(work_path)),
      wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

void Attempt::RequestCancel() {
  if (cancel_requested_.exchange(true)) return;
  cancel_time_nanos_ = absl::GetCurrentTimeNanos();
  eventfd_write(wake_.get(), 1);
}

JobManager::JobManager(const Options& options, std::unique_ptr<JobStore> store,
                       std::unique_ptr<BlobStore> blobs, Metrics* metrics, int64_t generation)
    : options_(options),
      store_(std::move(store)),
      blobs_(std::move(blobs)),
      metrics_(metrics),
      frame_counter_(generation, options.relay != nullptr) {}

absl::StatusOr<std::unique_ptr<JobManager>> JobManager::Create(const Options& options,
                                                               std::unique_ptr<JobStore> store,
                                                               std::unique_ptr<BlobStore> blobs,
                                                               Metrics* metrics) {
  AMHEX_ASSIGN_OR_RETURN(const int64_t generation, store->NextGeneration());
  AMHEX_ASSIGN_OR_RETURN(const int64_t requeued, store->RequeueRunning(options.node));
  if (requeued > 0) LogInfo("jobs_requeued", {{"count", requeued}});
  std::unique_ptr<JobManager> manager(
      new JobManager(options, std::move(store), std::move(blobs), metrics, generation));
  if (options.relay) {
    manager->store_->Subscribe(
        [raw = manager.get()](const std::string& id) { raw->HearOfChange(id); });
  }
  manager->housekeeper_ = std::thread([raw = manager.get()] { raw->Housekeep(); });
  return manager;
}

JobManager::~JobManager() {
  if (options_.relay) {
    store_->Unsubscribe();
    options_.relay->Stop();
  }
  {
    std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  housekeeper_wake_.notify_all();
  slots_wake_.notify_all();
  if (housekeeper_.joinable()) housekeeper_.join();
}

absl::Status JobManager::CheckDraining() const {
  if (!draining_) return absl::OkStatus();
  return WithRetryDelay(MakeError(absl::StatusCode::kUnavailable, amhex::v1::SERVER_DRAINING,
                                  "the server is shutting down"),
                        kDrainRetryDelay);
}

absl::StatusOr<amhex::v1::BlobRef> JobManager::CheckBlob(const amhex::v1::BlobRef& blob) {
  const auto size = blobs_->Size(blob.sha256());
  if (!size.ok()) {
    return WithPrecondition(
        MakeError(absl::StatusCode::kFailedPrecondition, amhex::v1::BLOB_MISSING,
                  "no blob " + blob.sha256() + " is stored; upload it first"),
        "MISSING", "blobs/" + blob.sha256());
  }
  if (blob.size_bytes() != 0 && blob.size_bytes() != *size) {
    FieldViolations bad;
    bad.Add("input_blob.size_bytes", "is " + std::to_string(blob.size_bytes()) +
                                         ", but the blob has " + std::to_string(*size) + " bytes");
    return bad.ToStatus();
  }
  blobs_->Touch(blob.sha256());
  amhex::v1::BlobRef whole = blob;
  whole.set_size_bytes(*size);
  return whole;
}

absl::StatusOr<amhex::v1::BlobRef> JobManager::AdmitInput(
    const amhex::v1::SubmitJobRequest& request) {
  amhex::v1::BlobRef input;
  std::string head;
  if (request.has_input_blob()) {
    AMHEX_ASSIGN_OR_RETURN(input, CheckBlob(request.input_blob()));
    AMHEX_ASSIGN_OR_RETURN(const UniqueFd fd, blobs_->OpenForRead(input.sha256()));
    head.resize(kPreflightBytes);
    AMHEX_ASSIGN_OR_RETURN(const size_t got, ReadAt(fd.get(), head.data(), head.size(), 0));
    head.resize(got);
  } else {
    input.set_size_bytes(static_cast<int64_t>(request.inline_input().size()));
  }
  const std::string& bytes = request.has_input_blob() ? head : request.inline_input();
  const absl::Status verdict = PreflightInput(
      request.input_encoding(),
      {reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size(), input.size_bytes()},
      options_.limits);
  if (!verdict.ok()) {
    metrics_->DecodeRejected(ReasonOf(verdict)).Increment();
    return verdict;
  }
  if (request.has_input_blob()) return input;
  return blobs_->Put(request.inline_input());
}

NewJob JobManager::MakeNewJob(const amhex::v1::SubmitJobRequest& request,
                              const amhex::v1::BlobRef& input) {
  NewJob fresh;
  fresh.id = MakeUuid(absl::Now());
  fresh.request_id = request.request_id();
  fresh.request_hash = RequestHash(request, input);
  fresh.ttl =
      request.has_ttl() ? FromProto(request.ttl()) : options_.limits.default_retention_duration;
  Job& job = fresh.job;
  *job.mutable_input() = input;
  job.set_input_encoding(request.input_encoding() == amhex::v1::INPUT_ENCODING_UNSPECIFIED
                             ? amhex::v1::INPUT_ENCODING_DRACO
                             : request.input_encoding());
  *job.mutable_params() = request.params();
  job.set_priority(request.has_priority() ? request.priority() : kDefaultPriority);
  *job.mutable_labels() = request.labels();
  job.set_request_id(request.request_id());
  if (request.has_queue_timeout()) *job.mutable_queue_timeout() = request.queue_timeout();
  *job.mutable_run_timeout() =
      request.has_run_timeout() ? request.run_timeout() : ToProto(options_.limits.max_run_duration);
  job.set_max_attempts(options_.limits.max_attempts);
  return fresh;
}

absl::StatusOr<Job> JobManager::Submit(const amhex::v1::SubmitJobRequest& request) {
  AMHEX_RETURN_IF_ERROR(CheckDraining());
  SubmittedJob submitted;
  {
    std::lock_guard<std::mutex> admission(admission_mutex_);
    AMHEX_ASSIGN_OR_RETURN(const amhex::v1::BlobRef input, AdmitInput(request));
    AMHEX_ASSIGN_OR_RETURN(
        submitted, store_->Submit(MakeNewJob(request, input), options_.limits.max_queued_job_count,
                                  absl::Now()));
  }
  if (submitted.is_new) {
    metrics_->jobs_submitted.Increment();
    LogInfo("job_queued", {{"job", submitted.job.name()},
                           {"input_bytes", submitted.job.input().size_bytes()},
                           {"priority", int64_t{submitted.job.priority()}}});
    WakeSlots();
  }
  return submitted.job;
}

std::shared_ptr<JobFeed> JobManager::FindFeed(const std::string& id) {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto found = feeds_.find(id);
  return found == feeds_.end() ? nullptr : found->second;
}

std::shared_ptr<JobFeed> JobManager::FeedFor(const std::string& id, const Job& job) {
  std::lock_guard<std::mutex> lock(mutex_);
  auto& feed = feeds_[id];
  if (!feed) feed = std::make_shared<JobFeed>(job, &frame_counter_);
  return feed;
}

absl::StatusOr<Job> JobManager::Get(const std::string& id) {
  AMHEX_ASSIGN_OR_RETURN(Job job, store_->Get(id));
  if (job.state() != Job::RUNNING) return job;
  const auto feed = FindFeed(id);
  if (!feed) return job;
  const Job live = feed->Current();
  if (live.attempt_count() != job.attempt_count()) return job;
  *job.mutable_stages() = live.stages();
  if (live.has_progress()) *job.mutable_progress() = live.progress();
  return job;
}

absl::StatusOr<JobPage> JobManager::List(const JobQuery& query) { return store_->List(query); }

absl::StatusOr<Job> JobManager::Cancel(const std::string& id) {
  AMHEX_ASSIGN_OR_RETURN(const Job before, store_->Get(id));
  if (IsFinal(before.state())) return before;
  AMHEX_ASSIGN_OR_RETURN(const Job job, store_->RequestCancel(id, CancelledOutcome(), absl::Now()));
  const std::shared_ptr<Attempt> attempt = FindAttempt(id);
  LogInfo("cancel_requested", {{"job", job.name()}, {"state", Job::State_Name(job.state())}});
  if (attempt) attempt->RequestCancel();
  // A queued job is final now; a running one is so when its worker has stopped.
  if (job.state() == Job::CANCELLED) CountFinished(job);
  PublishStored(id);
  return job;
}

absl::Status JobManager::Delete(const std::string& id) {
  AMHEX_RETURN_IF_ERROR(store_->Delete(id));
  std::lock_guard<std::mutex> lock(mutex_);
  feeds_.erase(id);
  LogInfo("job_deleted", {{"job", JobName(id)}});
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<FeedReader>> JobManager::Watch(
    const std::string& id, int64_t after_seq, absl::Duration min_interval,
    std::shared_ptr<FeedListener> listener) {
  // The feed is made before the job is read, so that no change between the two is missed.
  AMHEX_ASSIGN_OR_RETURN(const Job before, store_->Get(id));
  const auto feed = FeedFor(id, before);
  AMHEX_ASSIGN_OR_RETURN(const Job after, store_->Get(id));
  if (after.state() != feed->state()) feed->PublishJob(after);
  auto reader = FeedReader::Open(feed, after_seq, min_interval, options_.limits.max_watcher_count,
                                 std::move(listener));
  if (options_.relay) RefreshForeignFeed(id, feed);
  std::lock_guard<std::mutex> lock(mutex_);
  if (std::find(watched_feeds_.begin(), watched_feeds_.end(), feed) == watched_feeds_.end()) {
    watched_feeds_.push_back(feed);
  }
  return reader;
}

void JobManager::PublishStored(const std::string& id) {
  const auto feed = FindFeed(id);
  if (!feed) return;
  const auto job = store_->Get(id);
  if (!job.ok()) return;
  if (job->state() == Job::QUEUED) {
    feed->PublishRequeued(*job);
  } else {
    feed->PublishJob(*job);
  }
}

void JobManager::WakeSlots() {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    ++wake_count_;
  }
  slots_wake_.notify_all();
}

void JobManager::CountFinished(const Job& job) {
  const std::string state = Job::State_Name(job.state());
  const std::string reason = job.has_error() ? ReasonOf(job.error()) : "";
  metrics_->JobsFinished(state, reason).Increment();
  metrics_->attempts.Observe(job.attempt_count());
  double seconds = 0;
  if (job.has_start_time()) {
    seconds = absl::ToDoubleSeconds(FromProto(job.end_time()) - FromProto(job.start_time()));
    metrics_->job_duration_seconds.Observe(seconds);
  }
  LogInfo("job_finished", {{"job", job.name()},
                           {"state", state},
                           {"reason", reason},
                           {"attempts", int64_t{job.attempt_count()}},
                           {"seconds", seconds},
                           {"message", job.has_error() ? job.error().message() : ""}});
}

void JobManager::StartDraining() {
  {
    // Under the lock, so that a slot about to wait does not miss it.
    std::lock_guard<std::mutex> lock(mutex_);
    draining_ = true;
  }
  slots_wake_.notify_all();
}

void JobManager::CloseFeeds() {
  std::vector<std::shared_ptr<JobFeed>> feeds;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& entry : feeds_) feeds.push_back(entry.second);
  }
  for (const auto& feed : feeds) {
    feed->Close(MakeError(absl::StatusCode::kUnavailable, amhex::v1::SERVER_DRAINING,
                          "the server is shutting down; watch again with after_seq"));
  }
}

}  // namespace amhex::server
