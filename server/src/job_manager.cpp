#include "job_manager.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "errors.h"
#include "google/protobuf/io/coded_stream.h"
#include "google/protobuf/io/zero_copy_stream_impl_lite.h"
#include "job.h"
#include "job_id.h"
#include "job_record.h"
#include "logging.h"
#include "status_macros.h"
#include "time_convert.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

constexpr absl::Duration kDrainRetryDelay = absl::Seconds(5);

std::string DeterministicBytes(const google::protobuf::MessageLite& message) {
  std::string bytes;
  google::protobuf::io::StringOutputStream stream(&bytes);
  google::protobuf::io::CodedOutputStream coded(&stream);
  coded.SetSerializationDeterministic(true);
  message.SerializeToCodedStream(&coded);
  coded.Trim();
  return bytes;
}

// A digest of the request without its request_id; equal requests give equal digests.
std::string RequestHash(const amhex::v1::SubmitJobRequest& request,
                        const amhex::v1::BlobRef& input) {
  amhex::v1::SubmitJobRequest canonical = request;
  canonical.clear_request_id();
  *canonical.mutable_input_blob() = input;
  return Sha256Hex(DeterministicBytes(canonical));
}

// What decides the bits of a result. Neither the number of threads nor the bounds of a run do.
std::string CacheKey(const Job& job, const std::string& engine_build) {
  Job deciding;
  deciding.mutable_input()->set_sha256(job.input().sha256());
  deciding.set_input_encoding(job.input_encoding());
  *deciding.mutable_params() = job.params();
  if (deciding.params().has_run()) {
    deciding.mutable_params()->mutable_run()->clear_thread_count();
    deciding.mutable_params()->mutable_run()->clear_memory_limit_bytes();
  }
  return Sha256Hex(engine_build + "\n" + DeterministicBytes(deciding));
}

}  // namespace

std::string QuarantineKey(const std::string& tenant, const Job& job) {
  return tenant + "\n" + CacheKey(job, "");
}

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
      frame_counter_(generation, options.relay != nullptr),
      quarantine_(options.limits.max_attempts, options.limits.quarantine_duration) {
  // Opened, because a network file system answers a mere look from its memory.
  store_->CheckBlobsWith(
      [this](const std::string& sha256) { return blobs_->OpenForRead(sha256).ok(); });
}

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

NewJob JobManager::MakeNewJob(const Caller& caller, const amhex::v1::SubmitJobRequest& request,
                              const amhex::v1::BlobRef& input, const Admission& admission) {
  NewJob fresh;
  fresh.tenant = caller.tenant;
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
  job.set_trace_parent(admission.trace_parent);
  if (!options_.engine_build.empty() && !request.skip_cache()) {
    fresh.cache_key = CacheKey(job, options_.engine_build);
  }
  return fresh;
}

absl::StatusOr<SubmittedJob> JobManager::SubmitUnlessQuarantined(const NewJob& job) {
  const absl::Status refusal =
      quarantine_.Check(QuarantineKey(job.tenant.name, job.job), absl::Now());
  // A queue without room takes no new job, but gives those that it knows by their request_id.
  const int64_t room = refusal.ok() ? options_.limits.max_queued_job_count : 0;
  auto submitted = store_->Submit(job, room, absl::Now());
  if (!refusal.ok() && absl::IsResourceExhausted(submitted.status())) return refusal;
  return submitted;
}

absl::StatusOr<Job> JobManager::Submit(const Caller& caller,
                                       const amhex::v1::SubmitJobRequest& request,
                                       const Admission& admission) {
  AMHEX_RETURN_IF_ERROR(CheckDraining());
  MakeRoomForInput(static_cast<int64_t>(request.inline_input().size()));
  SubmittedJob submitted;
  {
    std::lock_guard<std::mutex> lock(admission_mutex_);
    const auto submit = [&]() -> absl::StatusOr<SubmittedJob> {
      AMHEX_ASSIGN_OR_RETURN(const AdmittedInput input, AdmitInput(caller, request));
      NewJob fresh = MakeNewJob(caller, request, input.blob, admission);
      const auto cost = AdmitCost(request.params(), input);
      if (cost.ok()) fresh.cost = *cost;
      auto stored = cost.ok() ? SubmitUnlessQuarantined(fresh) : cost.status();
      if (!stored.ok()) OwnRefusedInput(caller, request, input);
      return stored;
    };
    auto stored = submit();
    // Equal bytes that nothing used were there, and another node has just collected them.
    const bool is_missing = ReasonOf(stored.status()) == "BLOB_MISSING";
    if (is_missing && !request.has_input_blob()) stored = submit();
    if (!stored.ok()) return stored.status();
    submitted = *std::move(stored);
  }
  const Job& job = submitted.job;
  if (!submitted.is_new) return job;
  metrics_->jobs_submitted.Increment();
  metrics_->ResultCache(IsFinal(job.state()) ? "hit" : "miss").Increment();
  LogInfo("job_queued", {{"job", job.name()},
                         {"tenant", job.tenant()},
                         {"input_bytes", job.input().size_bytes()},
                         {"priority", int64_t{job.priority()}},
                         {"trace_parent", job.trace_parent()}});
  if (IsFinal(job.state())) {
    CountFinished(job);
  } else {
    WakeSlots();
  }
  return job;
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

absl::StatusOr<Job> JobManager::GetSeen(const Caller& caller, const std::string& id) {
  AMHEX_ASSIGN_OR_RETURN(Job job, store_->Get(id));
  if (!caller.Sees(job.tenant())) return JobNotFound(id);
  return job;
}

absl::StatusOr<Job> JobManager::GetRuled(const Caller& caller, const std::string& id) {
  AMHEX_ASSIGN_OR_RETURN(Job job, store_->Get(id));
  if (!caller.Rules(job.tenant())) return JobNotFound(id);
  return job;
}

absl::StatusOr<Job> JobManager::Get(const Caller& caller, const std::string& id) {
  AMHEX_ASSIGN_OR_RETURN(Job job, GetSeen(caller, id));
  if (job.state() != Job::RUNNING) return job;
  const auto feed = FindFeed(id);
  if (!feed) return job;
  const Job live = feed->Current();
  if (live.attempt_count() != job.attempt_count()) return job;
  *job.mutable_stages() = live.stages();
  if (live.has_progress()) *job.mutable_progress() = live.progress();
  return job;
}

absl::StatusOr<JobPage> JobManager::List(const Caller& caller, JobQuery query) {
  if (!caller.Has(Role::kReadAll)) query.tenant = caller.tenant.name;
  return store_->List(query);
}

absl::StatusOr<Job> JobManager::Cancel(const Caller& caller, const std::string& id) {
  AMHEX_ASSIGN_OR_RETURN(const Job before, GetRuled(caller, id));
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

absl::Status JobManager::Delete(const Caller& caller, const std::string& id) {
  AMHEX_ASSIGN_OR_RETURN(const Job job, GetRuled(caller, id));
  AMHEX_RETURN_IF_ERROR(store_->Delete(id));
  LetFeedGo(id, job);
  LogInfo("job_deleted", {{"job", JobName(id)}});
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<FeedReader>> JobManager::Watch(
    const Caller& caller, const amhex::v1::WatchJobRequest& request,
    std::shared_ptr<FeedListener> listener) {
  const std::string id = JobIdFromName(request.name());
  // The feed is made before the job is read, so that no change between the two is missed.
  AMHEX_ASSIGN_OR_RETURN(const Job before, GetSeen(caller, id));
  AMHEX_ASSIGN_OR_RETURN(
      auto place,
      watcher_places_.Take(caller.tenant.name, options_.limits.max_tenant_watcher_count));
  const auto feed = FeedFor(id, before);
  AMHEX_RETURN_IF_ERROR(PublishTo(feed, id).status());
  auto reader = FeedReader::Open(feed, request.after_seq(), FromProto(request.min_interval()),
                                 options_.limits.max_watcher_count, std::move(listener));
  if (reader.ok()) (*reader)->Keep(std::move(place));
  if (options_.relay) RefreshForeignFeed(id, feed);
  std::lock_guard<std::mutex> lock(mutex_);
  if (std::find(watched_feeds_.begin(), watched_feeds_.end(), feed) == watched_feeds_.end()) {
    watched_feeds_.push_back(feed);
  }
  return reader;
}

absl::StatusOr<Job> JobManager::PublishTo(const std::shared_ptr<JobFeed>& feed,
                                          const std::string& id) {
  return feed->PublishRead([this, &id] { return store_->Get(id); });
}

void JobManager::PublishStored(const std::string& id) {
  const auto feed = FindFeed(id);
  if (feed) PublishTo(feed, id).IgnoreError();
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
    // The clock may have been set back in between.
    seconds = std::max(
        absl::ToDoubleSeconds(FromProto(job.end_time()) - FromProto(job.start_time())), 0.0);
    metrics_->JobDuration(job.result().statistics().cell_count()).Observe(seconds);
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
