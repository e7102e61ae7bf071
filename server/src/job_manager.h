// The heart of amhexd: admission, the queue's rules, attempts, watching, retention. Knows neither
// gRPC nor processes: meshing_service calls it from above, worker_pool from below.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "amhex/v1/meshing_service.pb.h"
#include "blob_store.h"
#include "caller.h"
#include "errors.h"
#include "input_quarantine.h"
#include "job_feed.h"
#include "job_relay.h"
#include "job_store.h"
#include "metrics.h"
#include "service_limits.h"
#include "watcher_places.h"

namespace amhex::server {

// One running attempt at a job, shared by the manager and the worker slot that runs it.
class Attempt {
 public:
  Attempt(ClaimedJob claimed, std::shared_ptr<JobFeed> feed, std::string work_path);

  const std::string& id() const { return claimed_.id; }
  int64_t epoch() const { return claimed_.epoch; }
  const amhex::v1::Job& job() const { return claimed_.job; }
  // Where the worker writes the result.
  const std::string& work_path() const { return work_path_; }

  // Readable once a cancel was requested.
  int wake_fd() const { return wake_.get(); }
  bool cancel_requested() const { return cancel_requested_.load(); }
  void RequestCancel();

 private:
  friend class JobManager;
  const ClaimedJob claimed_;
  const std::shared_ptr<JobFeed> feed_;
  const std::string work_path_;
  UniqueFd wake_;
  std::atomic<bool> cancel_requested_{false};
  std::atomic<int64_t> cancel_time_nanos_{0};
};

// What is known of a job before it is queued, besides its request.
struct Admission {
  std::string trace_parent;  // W3C; empty: none
};

// An input that has passed the checks of its header.
struct AdmittedInput {
  amhex::v1::BlobRef blob;
  int64_t element_count = 0;  // triangles, points or cells; 0: the header's beginning does not tell
};

// A blob may be named with its size; one that is not the stored size is a bad field.
void CheckSaidSize(const std::string& field, const amhex::v1::BlobRef& blob, int64_t stored_size,
                   FieldViolations* bad);

// What a tenant's jobs with equal input and parameters share.
std::string QuarantineKey(const std::string& tenant, const amhex::v1::Job& job);

// Thread-safe. The methods that touch the store block for its disk.
class JobManager {
 public:
  struct Options {
    Limits limits;
    // Name of this server among those that share a store.
    std::string node = "local";
    // Where the others reach this one, and how it follows jobs that run on them; null: no others.
    std::string address;
    std::shared_ptr<JobRelay> relay;
    // Build of the engine, part of the key under which results are shared; empty: none are.
    std::string engine_build;
    absl::Duration lease = absl::Seconds(30);
    // What a job will need, from its parameters and the input's element count; no memory where
    // these do not tell, then unknown_memory_bytes are set aside. Null: nothing is counted.
    std::function<ExpectedCost(const amhex::v1::MeshingParams&, int64_t)> predict_cost;
    int64_t unknown_memory_bytes = 0;
    // Watchers of a job of which there is no news for so long get the job as it stands; WatchJob
    // promises them a frame every 15 s.
    absl::Duration quiet_feed_interval = absl::Seconds(10);
    // Wait before a job whose worker died is tried again; doubled per attempt.
    absl::Duration retry_delay = absl::Seconds(1);
    // Unused blobs and resting uploads are removed after these.
    absl::Duration unused_blob_age = absl::Hours(1);
    absl::Duration resting_upload_age = absl::Hours(24);
    // When blobs take more than nine tenths of their budget, unused ones and final jobs go sooner,
    // oldest first, until they take less than eight tenths; but none before this age.
    absl::Duration scarce_blob_age = absl::Minutes(10);
  };

  // Puts jobs that were running when the last server ended back into the queue.
  static absl::StatusOr<std::unique_ptr<JobManager>> Create(const Options& options,
                                                            std::unique_ptr<JobStore> store,
                                                            std::unique_ptr<BlobStore> blobs,
                                                            Metrics* metrics);
  ~JobManager();

  // For the service. The request's fields and the caller's role have been checked. What belongs to
  // a tenant that the caller does not see is NOT_FOUND.
  absl::StatusOr<amhex::v1::Job> Submit(const Caller& caller,
                                        const amhex::v1::SubmitJobRequest& request,
                                        const Admission& admission = {});
  // Where an input's bytes are, for validate_only: checks and stores it like Submit.
  absl::StatusOr<AdmittedInput> AdmitInputOfEstimate(const Caller& caller,
                                                     const amhex::v1::SubmitJobRequest& request);
  absl::StatusOr<amhex::v1::Job> Get(const Caller& caller, const std::string& id);
  absl::StatusOr<JobPage> List(const Caller& caller, JobQuery query);
  absl::StatusOr<amhex::v1::Job> Cancel(const Caller& caller, const std::string& id);
  absl::Status Delete(const Caller& caller, const std::string& id);
  absl::StatusOr<std::unique_ptr<FeedReader>> Watch(const Caller& caller,
                                                    const amhex::v1::WatchJobRequest& request,
                                                    std::shared_ptr<FeedListener> listener);

  // Blobs, as far as they are the caller's (job_manager_blobs.cpp).
  struct UploadState {
    int64_t committed_size = 0;
    bool complete = false;
  };
  absl::StatusOr<UploadState> FindUpload(const Caller& caller, const amhex::v1::BlobRef& blob);
  absl::StatusOr<std::unique_ptr<BlobUpload>> StartUpload(const Caller& caller,
                                                          const amhex::v1::BlobRef& blob);
  // Ends an upload and makes the blob the caller's.
  absl::Status FinishUpload(const Caller& caller, const amhex::v1::BlobRef& blob,
                            BlobUpload* upload);
  // Where the byte budget has no room for so many bytes: removes what has long not been used and,
  // if that does not do, the oldest results, as the next housekeeping would. True if they fit then,
  // false also if it is not the budget that is short.
  bool MakeRoomForInput(int64_t bytes);
  absl::StatusOr<UniqueFd> OpenBlob(const Caller& caller, const std::string& sha256);
  // The size of a blob that the caller has, which is kept for another while; else nothing.
  absl::StatusOr<std::optional<int64_t>> SizeOfBlob(const Caller& caller,
                                                    const amhex::v1::BlobRef& blob);
  // For workers of this machine.
  std::string PathOfBlob(const std::string& sha256) const { return blobs_->PathOf(sha256); }
  // A path for a worker's unfinished business; removed at the next start at the latest.
  std::string ScratchPath(const std::string& name) const { return blobs_->NewWorkPath(name, 0); }

  Metrics& metrics() { return *metrics_; }
  const Options& options() const { return options_; }

  // For worker slots. Every claimed attempt must end with exactly one of the calls below.
  // The next job, or null after `patience` or while draining.
  std::shared_ptr<Attempt> WaitForAttempt(const std::string& worker, absl::Duration patience);
  void ReportProgress(const Attempt& attempt, const amhex::v1::Progress& progress);
  void ReportStage(const Attempt& attempt, const amhex::v1::StageReport& stage);
  // False when the attempt was fenced: stop, and report nothing.
  bool KeepLease(Attempt& attempt);
  void Succeed(Attempt& attempt, amhex::v1::MeshingResult result);
  void Fail(Attempt& attempt, const absl::Status& error);
  void EndCancelled(Attempt& attempt);
  // Spends the attempt: queued again, or FAILED after the last one. Equal jobs are refused for a
  // while then, unless the device is to blame.
  enum class Suspect { kJob, kDevice };
  void WorkerDied(Attempt& attempt, const std::string& how, Suspect suspect);
  // The input has killed the decoder, as `how` the worker ended tells: FAILED.
  void DecoderDied(Attempt& attempt, const std::string& how);
  // The server interrupts: queued again, the attempt is not spent.
  void GiveBack(Attempt& attempt);

  // Refuses new jobs and hands out no more attempts.
  void StartDraining();
  bool draining() const { return draining_.load(); }
  // Ends all streams that watch.
  void CloseFeeds();

 private:
  JobManager(const Options& options, std::unique_ptr<JobStore> store,
             std::unique_ptr<BlobStore> blobs, Metrics* metrics, int64_t generation);

  absl::StatusOr<AdmittedInput> AdmitInput(const Caller& caller,
                                           const amhex::v1::SubmitJobRequest& request);
  absl::StatusOr<amhex::v1::BlobRef> CheckBlob(const Caller& caller,
                                               const amhex::v1::BlobRef& blob);
  // Whether the tenant has room for these bytes, if it does not own them yet.
  absl::Status CheckBlobQuota(const Tenant& tenant, const std::string& bytes);
  // An input that came inline is stored also where no job comes of it; then it counts as the
  // tenant's until it is collected, so that no one fills the disk past a quota.
  void OwnRefusedInput(const Caller& caller, const amhex::v1::SubmitJobRequest& request,
                       const AdmittedInput& input);
  // The job if the caller sees it, else NOT_FOUND.
  absl::StatusOr<amhex::v1::Job> GetSeen(const Caller& caller, const std::string& id);
  // The job if the caller may change it, else NOT_FOUND.
  absl::StatusOr<amhex::v1::Job> GetRuled(const Caller& caller, const std::string& id);
  absl::Status CheckDraining() const;
  NewJob MakeNewJob(const Caller& caller, const amhex::v1::SubmitJobRequest& request,
                    const amhex::v1::BlobRef& input, const Admission& admission);
  // What to set aside for a job; RESOURCE_EXHAUSTED OUT_OF_MEMORY when it can never run here.
  absl::StatusOr<ExpectedCost> AdmitCost(const amhex::v1::MeshingParams& params,
                                         const AdmittedInput& input) const;
  absl::StatusOr<SubmittedJob> SubmitUnlessQuarantined(const NewJob& job);
  int64_t MostMemoryOfOneJob() const;
  // Set aside for the running jobs, and what is left of their budget.
  int64_t ReservedMemory();
  int64_t FreeMemory();
  // How the memory set aside for an attempt compares with what it took.
  void ObserveMemory(const Attempt& attempt);
  std::shared_ptr<Attempt> ClaimNext(const std::string& worker);
  std::shared_ptr<JobFeed> FeedFor(const std::string& id, const amhex::v1::Job& job);
  std::shared_ptr<JobFeed> FindFeed(const std::string& id);
  void Finish(Attempt& attempt, const FinalOutcome& outcome);
  // Back to the queue for `delay` at least, unless its cancel was requested: then the job ends.
  void Requeue(Attempt& attempt, ReleaseMode mode, absl::Duration delay);
  void CountFinished(const amhex::v1::Job& job);
  void Forget(const Attempt& attempt);
  // Makes a blob of what the attempt's worker has written.
  absl::StatusOr<amhex::v1::BlobRef> AdoptResult(const Attempt& attempt);
  // Both read the job anew and tell its watchers.
  absl::StatusOr<amhex::v1::Job> PublishTo(const std::shared_ptr<JobFeed>& feed,
                                           const std::string& id);
  void PublishStored(const std::string& id);
  void PublishFinished(const std::string& id);
  void WakeSlots();

  // In a cluster: a job was changed, perhaps by another node. Empty: any may have been.
  void HearOfChange(const std::string& id);
  std::shared_ptr<Attempt> FindAttempt(const std::string& id);
  // Brings the feeds of jobs that do not run here up to date.
  void TendForeignFeeds();
  void RefreshForeignFeed(const std::string& id, const std::shared_ptr<JobFeed>& feed);
  // Finishes as soon as the store can be reached, while the lease may still hold.
  absl::StatusOr<std::vector<std::string>> FinishPatiently(const Attempt& attempt,
                                                           const FinalOutcome& outcome);

  void Housekeep();
  void TendWatchedFeeds();
  void BreakSilence(const std::shared_ptr<JobFeed>& feed);
  // Of a job that is gone: whoever watches it still hears of its end, if that is known, and leaves.
  void LetFeedGo(const std::string& id, const amhex::v1::Job& job);
  void ForgetQuietFeeds();
  void EndReaped(const ReapedLeases& reaped, absl::Time now);
  void EndReapedJob(const ClaimedJob& job, const FinalOutcome& outcome, absl::Time now);
  void KeepLeasesAfterAJump(absl::Time now);
  void TendQueue();
  // Room for `wanted_bytes` counts as taken.
  void CollectGarbage(int64_t wanted_bytes);
  // Removes blobs that nobody has used since, and returns the bytes freed.
  int64_t CollectUnused(absl::Time unused_since);
  void MakeRoom(absl::Time now, int64_t wanted_bytes);

  const Options options_;
  const std::unique_ptr<JobStore> store_;
  const std::unique_ptr<BlobStore> blobs_;
  Metrics* const metrics_;
  FrameCounter frame_counter_;
  std::atomic<bool> draining_{false};
  WatcherPlaces watcher_places_;
  InputQuarantine quarantine_;

  // Held from the check that a blob exists until the job that needs it is stored, and while an
  // unused blob is collected.
  std::mutex admission_mutex_;

  std::mutex input_room_mutex_;
  absl::Time next_input_room_ = absl::InfinitePast();  // of MonotonicNow

  // Held while memory is set aside: from the look at what is free to the entry in attempts_.
  std::mutex claim_mutex_;

  std::mutex mutex_;
  std::condition_variable slots_wake_;
  int64_t wake_count_ = 0;
  std::map<std::string, std::shared_ptr<JobFeed>> feeds_;     // by job id
  std::vector<std::shared_ptr<JobFeed>> watched_feeds_;       // those that have readers
  std::map<std::string, std::shared_ptr<Attempt>> attempts_;  // by job id, running
  bool stopping_ = false;
  absl::Time last_tended_ = absl::Now();  // by the housekeeper, and for it alone
  std::condition_variable housekeeper_wake_;
  std::thread housekeeper_;
};

}  // namespace amhex::server
