#include "job_feed.h"

#include <algorithm>
#include <string>
#include <utility>

#include "errors.h"
#include "google/protobuf/util/message_differencer.h"
#include "job.h"
#include "monotonic_clock.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;
using amhex::v1::WatchJobResponse;

// About a minute of progress at the workers' highest rate.
constexpr size_t kMaxSkippableFrames = 1024;

void WakeAll(const std::vector<std::shared_ptr<FeedListener>>& listeners) {
  for (const auto& listener : listeners) listener->Wake();
}

}  // namespace

void FrameCounter::AdvanceBeyond(int64_t seq) {
  int64_t next = next_.load();
  while (next <= seq && !next_.compare_exchange_weak(next, seq + 1)) {
  }
}

JobFeed::JobFeed(const Job& job, FrameCounter* counter)
    : counter_(counter), current_(job), last_publish_time_(MonotonicNow()) {
  last_seq_ = counter_->Next();
  last_dropped_seq_ = last_seq_;
}

JobFeed::Listeners JobFeed::AppendLocked(Frame frame) {
  if (frame.kind == FrameKind::kRepeat) DropLastRepeatLocked();
  last_seq_ = counter_->Next();
  frame.response.set_seq(last_seq_);
  skippable_frame_count_ += frame.can_be_skipped() ? 1 : 0;
  frames_.push_back(std::move(frame));
  last_publish_time_ = MonotonicNow();
  DropOldSkippableLocked();
  return ListenersLocked();
}

// What it said is said again: no reader misses anything, so that no gap is to be told of.
void JobFeed::DropLastRepeatLocked() {
  if (frames_.empty() || frames_.back().kind != FrameKind::kRepeat) return;
  frames_.pop_back();
  --skippable_frame_count_;
}

void JobFeed::DropOldSkippableLocked() {
  while (skippable_frame_count_ > kMaxSkippableFrames) {
    const auto oldest = std::find_if(frames_.begin(), frames_.end(),
                                     [](const Frame& frame) { return frame.can_be_skipped(); });
    last_dropped_seq_ = std::max(last_dropped_seq_, oldest->response.seq());
    frames_.erase(oldest);
    --skippable_frame_count_;
  }
}

JobFeed::Listeners JobFeed::ListenersLocked() {
  Listeners alive;
  for (const auto& weak : listeners_) {
    if (auto listener = weak.lock()) alive.push_back(std::move(listener));
  }
  return alive;
}

JobFeed::Listeners JobFeed::TakeJob(const Job& job, Known known, Before before) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (IsFinal(current_.state())) return {};
  if (before == Before::kForget || job.state() == Job::QUEUED ||
      job.attempt_count() != current_.attempt_count()) {
    current_.clear_progress();
    current_.clear_stages();
  }
  Job merged = job;
  if (merged.stages().empty()) *merged.mutable_stages() = current_.stages();
  if (!merged.has_progress() && current_.has_progress()) {
    *merged.mutable_progress() = current_.progress();
  }
  const bool is_known = google::protobuf::util::MessageDifferencer::Equals(merged, current_);
  if (is_known && known == Known::kSkip) return {};
  current_ = merged;
  Frame frame;
  frame.kind = is_known ? FrameKind::kRepeat : FrameKind::kNews;
  *frame.response.mutable_job() = std::move(merged);
  return AppendLocked(std::move(frame));
}

void JobFeed::PublishJob(const Job& job) { WakeAll(TakeJob(job, Known::kRepeat, Before::kKeep)); }

absl::StatusOr<Job> JobFeed::PublishInOrder(const JobSource& read, Before before) {
  Listeners listeners;
  absl::StatusOr<Job> job;
  {
    std::lock_guard<std::mutex> reading(reading_mutex_);
    job = read();
    if (job.ok()) listeners = TakeJob(*job, Known::kSkip, before);
  }
  WakeAll(listeners);
  return job;
}

absl::StatusOr<Job> JobFeed::PublishRead(const JobSource& read) {
  return PublishInOrder(read, Before::kKeep);
}

absl::StatusOr<Job> JobFeed::PublishBegun(const JobSource& read) {
  return PublishInOrder(read, Before::kForget);
}

void JobFeed::Repeat() {
  Listeners listeners;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (IsFinal(current_.state())) return;
    Frame frame;
    frame.kind = FrameKind::kRepeat;
    *frame.response.mutable_job() = current_;
    listeners = AppendLocked(std::move(frame));
  }
  WakeAll(listeners);
}

void JobFeed::PublishProgress(const amhex::v1::Progress& progress) {
  Listeners listeners;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (IsFinal(current_.state())) return;
    *current_.mutable_progress() = progress;
    Frame frame;
    frame.kind = FrameKind::kProgress;
    *frame.response.mutable_progress() = progress;
    listeners = AppendLocked(std::move(frame));
  }
  WakeAll(listeners);
}

void JobFeed::PublishStage(const amhex::v1::StageReport& stage) {
  Listeners listeners;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (IsFinal(current_.state())) return;
    *current_.add_stages() = stage;
    Frame frame;
    *frame.response.mutable_stage() = stage;
    listeners = AppendLocked(std::move(frame));
  }
  WakeAll(listeners);
}

void JobFeed::Close(const absl::Status& reason) {
  Listeners listeners;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    closed_ = reason;
    listeners = ListenersLocked();
  }
  WakeAll(listeners);
}

Job JobFeed::Current() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return current_;
}

Job::State JobFeed::state() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return current_.state();
}

absl::Time JobFeed::last_publish_time() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return last_publish_time_;
}

int32_t JobFeed::reader_count() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return reader_count_;
}

void JobFeed::WakeReaders() {
  Listeners listeners;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    listeners = ListenersLocked();
  }
  WakeAll(listeners);
}

FeedReader::FeedReader(std::shared_ptr<JobFeed> feed, absl::Duration min_interval)
    : feed_(std::move(feed)), min_interval_(min_interval) {}

absl::StatusOr<std::unique_ptr<FeedReader>> FeedReader::Open(
    const std::shared_ptr<JobFeed>& feed, int64_t after_seq, absl::Duration min_interval,
    int32_t max_readers, const std::shared_ptr<FeedListener>& listener) {
  std::lock_guard<std::mutex> lock(feed->mutex_);
  if (after_seq > feed->last_seq_ && feed->counter_->has_peers() &&
      after_seq <= FrameCounter::kMaxForeignSeq) {
    // Another server has sent that frame. What the reader has missed is not known here; it gets
    // the whole job and is told of the gap.
    feed->counter_->AdvanceBeyond(after_seq);
    feed->last_seq_ = feed->counter_->Next();
    feed->last_dropped_seq_ = feed->last_seq_;
  }
  if (after_seq > feed->last_seq_) {
    FieldViolations bad;
    bad.Add("after_seq", "is " + std::to_string(after_seq) + ", but the last frame sent is " +
                             std::to_string(feed->last_seq_));
    return bad.ToStatus();
  }
  if (feed->reader_count_ >= max_readers) {
    return MakeError(absl::StatusCode::kResourceExhausted, amhex::v1::TOO_MANY_WATCHERS,
                     std::to_string(max_readers) + " streams watch the job, which is the limit");
  }
  std::unique_ptr<FeedReader> reader(new FeedReader(feed, min_interval));
  reader->after_seq_ = after_seq;
  reader->listener_ = listener;
  ++feed->reader_count_;
  auto& listeners = feed->listeners_;
  listeners.erase(std::remove_if(listeners.begin(), listeners.end(),
                                 [](const auto& weak) { return weak.expired(); }),
                  listeners.end());
  listeners.push_back(listener);
  return reader;
}

FeedReader::~FeedReader() {
  std::lock_guard<std::mutex> lock(feed_->mutex_);
  --feed_->reader_count_;
  auto& listeners = feed_->listeners_;
  listeners.erase(std::remove_if(listeners.begin(), listeners.end(),
                                 [this](const auto& weak) {
                                   const auto listener = weak.lock();
                                   return !listener || listener == listener_;
                                 }),
                  listeners.end());
}

// The whole job, numbered so that what follows is new to the reader.
FeedReader::Item FeedReader::First() {
  WatchJobResponse response;
  *response.mutable_job() = feed_->current_;
  if (after_seq_ == 0) {
    position_ = feed_->last_seq_;
  } else {
    response.set_gap(after_seq_ < feed_->last_dropped_seq_);
    position_ = std::max(after_seq_, feed_->last_dropped_seq_);
  }
  replay_until_ = feed_->last_seq_;
  response.set_seq(position_);
  snapshot_sent_ = true;
  // With frames left to replay, the final one among them ends the stream.
  final_sent_ = IsFinal(feed_->current_.state()) && position_ >= feed_->last_seq_;
  return {std::move(response), std::nullopt};
}

FeedReader::Item FeedReader::Next(absl::Time now) {
  std::lock_guard<std::mutex> lock(feed_->mutex_);
  if (!snapshot_sent_) return First();
  if (final_sent_) return {std::nullopt, absl::OkStatus()};
  const auto& frames = feed_->frames_;
  auto next = std::upper_bound(
      frames.begin(), frames.end(), position_,
      [](int64_t seq, const JobFeed::Frame& frame) { return seq < frame.response.seq(); });
  if (next == frames.end()) {
    return {std::nullopt, feed_->closed_};
  }
  const bool replaying = next->response.seq() <= replay_until_;
  if (next->can_be_skipped() && !replaying) {
    // Only the newest of consecutive frames like these is worth sending.
    int64_t passed_over = 0;
    while (next + 1 != frames.end() && (next + 1)->can_be_skipped()) {
      ++next;
      ++passed_over;
    }
    const bool is_last = next + 1 == frames.end();
    if (is_last && now - last_progress_time_ < min_interval_) return {};
    last_progress_time_ = now;
    conflated_count_ += passed_over;
  }
  position_ = next->response.seq();
  final_sent_ = next->response.has_job() && IsFinal(next->response.job().state());
  return {next->response, std::nullopt};
}

}  // namespace amhex::server
