// What watchers of one job see: numbered frames, kept for replay, conflated for slow readers.
//
// Writers never wait for readers and readers hold no queue: each reader has a place in the shared
// frames and skips progress frames that newer ones have overtaken. Changes of the job and stage
// reports are never skipped; only progress frames are dropped when the feed is full. A job that is
// published once more as it was, to break a silence, takes the place of the one before: waiting for
// a job costs no memory, however long.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "amhex/v1/meshing_service.pb.h"
#include "watcher_places.h"

namespace amhex::server {

// Is told when there may be something new to read. Called from any thread, never under the feed's
// lock; must not block.
class FeedListener {
 public:
  virtual ~FeedListener() = default;
  virtual void Wake() = 0;
};

// Numbers the frames of all feeds of one server run. `generation` grows from run to run, so that
// numbers keep growing over restarts.
class FrameCounter {
 public:
  explicit FrameCounter(int64_t generation, bool has_peers = false)
      : has_peers_(has_peers), next_((generation << kGenerationShift) + 1) {}
  int64_t Next() { return next_.fetch_add(1, std::memory_order_relaxed); }
  // True when readers may come from servers that number on their own.
  bool has_peers() const { return has_peers_; }
  // Sees to it that all further numbers are larger than `seq`, at most kMaxForeignSeq.
  void AdvanceBeyond(int64_t seq);

  // No server comes near this number; half of all numbers are left above it.
  static constexpr int64_t kMaxForeignSeq = int64_t{1} << 62;

 private:
  static constexpr int kGenerationShift = 40;  // 10^12 frames per run, 8 million runs
  const bool has_peers_;
  std::atomic<int64_t> next_;
};

// Thread-safe.
class JobFeed {
 public:
  // `job` is the job as it stands; its frame is the feed's first.
  JobFeed(const amhex::v1::Job& job, FrameCounter* counter);

  // A job that has become final stays as it is: what is published later is not heard. One that is
  // queued or in another attempt loses the progress and stages of the attempt before.
  void PublishJob(const amhex::v1::Job& job);
  void PublishProgress(const amhex::v1::Progress& progress);
  void PublishStage(const amhex::v1::StageReport& stage);
  // Where several threads read a job from the store and publish it: they do so one after another,
  // so that none publishes what another's news have overtaken. A job that the readers know already
  // is not told again; nor is anything where `read` fails. Returns what was read. `read` may block.
  using JobSource = std::function<absl::StatusOr<amhex::v1::Job>()>;
  absl::StatusOr<amhex::v1::Job> PublishRead(const JobSource& read);
  // The same for an attempt that begins: progress and stages are forgotten in any case.
  absl::StatusOr<amhex::v1::Job> PublishBegun(const JobSource& read);
  // Tells the job once more as it is, to break a silence, unless it is final.
  void Repeat();
  // Ends every stream with `reason` once it has read what there is.
  void Close(const absl::Status& reason);

  // The job with the progress and stages of the running attempt.
  amhex::v1::Job Current() const;
  amhex::v1::Job::State state() const;
  // When the latest frame was published.
  absl::Time last_publish_time() const;
  int32_t reader_count() const;
  void WakeReaders();

 private:
  friend class FeedReader;
  enum class FrameKind { kNews, kProgress, kRepeat };
  struct Frame {
    amhex::v1::WatchJobResponse response;
    FrameKind kind = FrameKind::kNews;
    // Whether a reader may do without it when there is a newer frame.
    bool can_be_skipped() const { return kind != FrameKind::kNews; }
  };

  using Listeners = std::vector<std::shared_ptr<FeedListener>>;
  enum class Known { kRepeat, kSkip };   // what to do with a job that the readers know
  enum class Before { kKeep, kForget };  // the progress and stages that the feed has

  absl::StatusOr<amhex::v1::Job> PublishInOrder(const JobSource& read, Before before);
  // Both append and return whom to wake.
  Listeners TakeJob(const amhex::v1::Job& job, Known known, Before before);
  Listeners AppendLocked(Frame frame);
  void DropLastRepeatLocked();
  void DropOldSkippableLocked();
  Listeners ListenersLocked();

  FrameCounter* const counter_;
  std::mutex reading_mutex_;  // held while a job is read and taken; before mutex_
  mutable std::mutex mutex_;
  amhex::v1::Job current_;
  std::deque<Frame> frames_;  // ascending by seq
  int64_t last_dropped_seq_ = 0;
  int64_t last_seq_ = 0;
  size_t skippable_frame_count_ = 0;
  absl::Time last_publish_time_;
  std::optional<absl::Status> closed_;
  std::vector<std::weak_ptr<FeedListener>> listeners_;
  int32_t reader_count_ = 0;
};

// One stream's place in a feed. Thread-compatible.
class FeedReader {
 public:
  struct Item {
    std::optional<amhex::v1::WatchJobResponse> frame;
    std::optional<absl::Status> end;  // the stream is over
  };                                  // neither: nothing to send now; the listener will be woken

  // INVALID_ARGUMENT for an `after_seq` never sent (by this server or a peer), RESOURCE_EXHAUSTED
  // TOO_MANY_WATCHERS.
  static absl::StatusOr<std::unique_ptr<FeedReader>> Open(
      const std::shared_ptr<JobFeed>& feed, int64_t after_seq, absl::Duration min_interval,
      int32_t max_readers, const std::shared_ptr<FeedListener>& listener);
  ~FeedReader();

  Item Next(absl::Time now);
  // Gives the place back when the stream ends.
  void Keep(std::unique_ptr<WatcherPlaces::Place> place) { place_ = std::move(place); }
  // Progress frames passed over so far.
  int64_t conflated_count() const { return conflated_count_; }

 private:
  FeedReader(std::shared_ptr<JobFeed> feed, absl::Duration min_interval);
  Item First();

  std::shared_ptr<JobFeed> feed_;
  std::shared_ptr<FeedListener> listener_;
  std::unique_ptr<WatcherPlaces::Place> place_;
  const absl::Duration min_interval_;
  int64_t after_seq_ = 0;
  int64_t position_ = 0;      // seq of the last frame sent
  int64_t replay_until_ = 0;  // frames up to here are sent one by one
  bool snapshot_sent_ = false;
  bool final_sent_ = false;
  absl::Time last_progress_time_ = absl::InfinitePast();
  int64_t conflated_count_ = 0;
};

}  // namespace amhex::server
