#include "job_feed.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "absl/time/clock.h"
#include "errors.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;
using amhex::v1::WatchJobResponse;

constexpr int kManyReaders = 100;

class Bell : public FeedListener {
 public:
  void Wake() override { ++count; }  // from any thread
  std::atomic<int> count = 0;
};

Job MakeJob(Job::State state) {
  Job job;
  job.set_name("jobs/x");
  job.set_state(state);
  return job;
}

amhex::v1::Progress Iteration(int iteration) {
  amhex::v1::Progress progress;
  progress.set_iteration(iteration);
  return progress;
}

class JobFeedTest : public ::testing::Test {
 protected:
  std::unique_ptr<FeedReader> Open(int64_t after_seq = 0,
                                   absl::Duration interval = absl::ZeroDuration()) {
    auto reader = FeedReader::Open(feed_, after_seq, interval, kManyReaders, bell_);
    EXPECT_TRUE(reader.ok()) << reader.status();
    return reader.ok() ? *std::move(reader) : nullptr;
  }

  WatchJobResponse Take(FeedReader* reader) {
    const auto item = reader->Next(now_);
    EXPECT_TRUE(item.frame.has_value());
    return item.frame.value_or(WatchJobResponse());
  }

  // All frames there are, until nothing is left to read.
  std::vector<WatchJobResponse> TakeAll(FeedReader* reader) {
    std::vector<WatchJobResponse> frames;
    while (true) {
      auto item = reader->Next(now_);
      if (!item.frame) return frames;
      frames.push_back(*std::move(item.frame));
    }
  }

  absl::Time now_ = absl::FromUnixSeconds(1'700'000'000);
  FrameCounter counter_{7};
  std::shared_ptr<JobFeed> feed_ = std::make_shared<JobFeed>(MakeJob(Job::QUEUED), &counter_);
  std::shared_ptr<Bell> bell_ = std::make_shared<Bell>();
};

TEST_F(JobFeedTest, FirstFrameIsTheWholeJob) {
  feed_->PublishProgress(Iteration(3));
  const auto reader = Open();
  const WatchJobResponse first = Take(reader.get());
  EXPECT_EQ(first.job().name(), "jobs/x");
  EXPECT_EQ(first.job().progress().iteration(), 3);
  EXPECT_FALSE(first.gap());
  EXPECT_FALSE(reader->Next(now_).frame.has_value());
}

TEST_F(JobFeedTest, NumbersGrowStrictly) {
  const auto reader = Open();
  int64_t last = Take(reader.get()).seq();
  for (int i = 0; i < 100; ++i) {
    feed_->PublishProgress(Iteration(i));
    if (i % 10 == 0) feed_->PublishStage({});
    for (const auto& frame : TakeAll(reader.get())) {
      EXPECT_GT(frame.seq(), last);
      last = frame.seq();
    }
  }
}

TEST_F(JobFeedTest, NumbersGrowFromRunToRun) {
  FrameCounter next_run(8);
  EXPECT_GT(next_run.Next(), Take(Open().get()).seq());
}

TEST_F(JobFeedTest, SlowReaderGetsOnlyTheNewestProgressButEveryStage) {
  const auto reader = Open();
  Take(reader.get());
  for (int i = 0; i < 50; ++i) feed_->PublishProgress(Iteration(i));
  feed_->PublishStage({});
  for (int i = 50; i < 90; ++i) feed_->PublishProgress(Iteration(i));
  const auto frames = TakeAll(reader.get());
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[0].progress().iteration(), 49);
  EXPECT_TRUE(frames[1].has_stage());
  EXPECT_EQ(frames[2].progress().iteration(), 89);
  EXPECT_EQ(reader->conflated_count(), 88);
}

TEST_F(JobFeedTest, ReconnectionReplaysEveryFrameSinceTheLastSeen) {
  const auto reader = Open();
  Take(reader.get());
  feed_->PublishProgress(Iteration(1));
  const int64_t seen = Take(reader.get()).seq();
  for (int i = 2; i < 20; ++i) feed_->PublishProgress(Iteration(i));
  const auto again = Open(seen);
  const auto frames = TakeAll(again.get());
  ASSERT_EQ(frames.size(), 19u);
  EXPECT_TRUE(frames[0].has_job());
  EXPECT_EQ(frames[0].seq(), seen);
  EXPECT_FALSE(frames[0].gap());
  for (int i = 2; i < 20; ++i) {
    EXPECT_EQ(frames[static_cast<size_t>(i) - 1].progress().iteration(), i);
  }
}

TEST_F(JobFeedTest, LostFramesAreAnnouncedAsAGap) {
  const auto reader = Open();
  const int64_t seen = Take(reader.get()).seq();
  for (int i = 0; i < 5000; ++i) feed_->PublishProgress(Iteration(i));
  const auto again = Open(seen);
  const WatchJobResponse first = Take(again.get());
  EXPECT_TRUE(first.gap());
  EXPECT_GT(first.seq(), seen);
  EXPECT_EQ(first.job().progress().iteration(), 4999);
}

TEST_F(JobFeedTest, FullFeedDropsProgressAndKeepsStages) {
  feed_->PublishStage({});
  const auto reader = Open();
  Take(reader.get());
  feed_->PublishStage({});
  for (int i = 0; i < 5000; ++i) feed_->PublishProgress(Iteration(i));
  const auto frames = TakeAll(reader.get());
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_TRUE(frames[0].has_stage());
}

TEST_F(JobFeedTest, JobPublishedAgainAsItWasTakesNoMoreRoom) {
  const auto slow = Open();
  const int64_t seen = Take(slow.get()).seq();
  const auto reader = Open();
  int64_t last = Take(reader.get()).seq();
  for (int i = 0; i < 5000; ++i) {
    feed_->Repeat();
    // Whoever waits hears of each.
    const WatchJobResponse frame = Take(reader.get());
    EXPECT_EQ(frame.job().state(), Job::QUEUED);
    EXPECT_GT(frame.seq(), last);
    last = frame.seq();
  }
  EXPECT_EQ(TakeAll(slow.get()).size(), 1u);
  // One that comes back finds no more than one of them kept, and has missed nothing.
  const auto frames = TakeAll(Open(seen).get());
  EXPECT_LE(frames.size(), 2u);
  EXPECT_FALSE(frames.at(0).gap());
}

TEST_F(JobFeedTest, JobPublishedAgainDoesNotHideWhatCameBefore) {
  const auto reader = Open();
  Take(reader.get());
  feed_->PublishJob(MakeJob(Job::RUNNING));
  feed_->Repeat();
  feed_->PublishStage({});
  feed_->Repeat();
  feed_->PublishJob(MakeJob(Job::SUCCEEDED));
  feed_->Repeat();
  std::vector<std::string> told;
  for (const auto& frame : TakeAll(reader.get())) {
    told.push_back(frame.has_stage() ? "stage" : Job::State_Name(frame.job().state()));
  }
  told.erase(std::unique(told.begin(), told.end()), told.end());
  EXPECT_EQ(told, (std::vector<std::string>{"RUNNING", "stage", "RUNNING", "SUCCEEDED"}));
}

TEST_F(JobFeedTest, SilencesBetweenProgressTakeNoMoreRoomThanProgress) {
  feed_->PublishStage({});
  const auto reader = Open();
  const int64_t seen = Take(reader.get()).seq();
  for (int i = 0; i < 5000; ++i) {
    feed_->PublishProgress(Iteration(i));
    feed_->Repeat();
  }
  EXPECT_LT(TakeAll(Open(seen).get()).size(), 2000u);
}

TEST_F(JobFeedTest, NumberNeverSentIsRefused) {
  const auto reader =
      FeedReader::Open(feed_, int64_t{1} << 60, absl::ZeroDuration(), kManyReaders, bell_);
  EXPECT_EQ(ReasonOf(reader.status()), "BAD_REQUEST");
}

TEST_F(JobFeedTest, StreamEndsAfterTheFinalJob) {
  const auto reader = Open();
  Take(reader.get());
  feed_->PublishJob(MakeJob(Job::SUCCEEDED));
  EXPECT_EQ(Take(reader.get()).job().state(), Job::SUCCEEDED);
  const auto end = reader->Next(now_).end;
  ASSERT_TRUE(end.has_value());
  EXPECT_TRUE(end->ok());
}

TEST_F(JobFeedTest, WatchingAFinalJobGivesItAndEnds) {
  feed_->PublishJob(MakeJob(Job::FAILED));
  const auto reader = Open();
  EXPECT_EQ(Take(reader.get()).job().state(), Job::FAILED);
  EXPECT_TRUE(reader->Next(now_).end.has_value());
}

TEST_F(JobFeedTest, IntervalHoldsProgressBackButNotStages) {
  const auto reader = Open(0, absl::Seconds(1));
  Take(reader.get());
  feed_->PublishProgress(Iteration(1));
  EXPECT_EQ(Take(reader.get()).progress().iteration(), 1);
  feed_->PublishProgress(Iteration(2));
  EXPECT_FALSE(reader->Next(now_).frame.has_value());
  now_ += absl::Seconds(1);
  EXPECT_EQ(Take(reader.get()).progress().iteration(), 2);
  feed_->PublishStage({});
  EXPECT_TRUE(Take(reader.get()).has_stage());
}

TEST_F(JobFeedTest, ReadersAreWokenByEveryFrameUntilTheyLeave) {
  auto reader = Open();
  feed_->PublishProgress(Iteration(1));
  feed_->PublishStage({});
  EXPECT_EQ(bell_->count, 2);
  reader.reset();
  feed_->PublishProgress(Iteration(2));
  EXPECT_EQ(bell_->count, 2);
  EXPECT_EQ(feed_->reader_count(), 0);
}

TEST_F(JobFeedTest, ReadersBeyondTheLimitAreRefused) {
  const auto first = Open();
  const auto second = FeedReader::Open(feed_, 0, absl::ZeroDuration(), 1, bell_);
  EXPECT_EQ(ReasonOf(second.status()), "TOO_MANY_WATCHERS");
}

TEST_F(JobFeedTest, RequeuedJobForgetsTheProgressOfItsLostAttempt) {
  feed_->PublishProgress(Iteration(9));
  feed_->PublishStage({});
  feed_->PublishJob(MakeJob(Job::QUEUED));
  EXPECT_FALSE(feed_->Current().has_progress());
  EXPECT_EQ(feed_->Current().stages_size(), 0);
}

TEST_F(JobFeedTest, AttemptThatBeginsForgetsTheProgressOfOneThatWasGivenBack) {
  feed_->PublishJob(MakeJob(Job::RUNNING));
  feed_->PublishProgress(Iteration(9));
  feed_->PublishStage({});
  ASSERT_TRUE(feed_->PublishBegun([] { return MakeJob(Job::RUNNING); }).ok());
  EXPECT_FALSE(feed_->Current().has_progress());
  EXPECT_EQ(feed_->Current().stages_size(), 0);
}

TEST_F(JobFeedTest, FinalJobStaysFinalWhateverIsPublishedLate) {
  const auto reader = Open();
  Take(reader.get());
  feed_->PublishJob(MakeJob(Job::FAILED));
  feed_->PublishJob(MakeJob(Job::RUNNING));
  feed_->PublishProgress(Iteration(1));
  feed_->PublishStage({});
  feed_->Repeat();
  ASSERT_TRUE(feed_->PublishRead([] { return MakeJob(Job::QUEUED); }).ok());
  EXPECT_EQ(feed_->state(), Job::FAILED);
  EXPECT_EQ(Take(reader.get()).job().state(), Job::FAILED);
  EXPECT_TRUE(reader->Next(now_).end.has_value());
}

// A store whose answers grow old on their way: each is the newest when it is read.
TEST_F(JobFeedTest, WhatWasReadEarlierIsNeverPublishedLater) {
  const auto reader = Open();
  Take(reader.get());
  std::atomic<int> version = 0;
  const auto read = [&]() -> absl::StatusOr<Job> {
    Job job = MakeJob(Job::RUNNING);
    job.set_priority(++version);
    absl::SleepFor(absl::Microseconds(job.priority() % 7 * 50));
    return job;
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      for (int k = 0; k < 50; ++k) EXPECT_TRUE(feed_->PublishRead(read).ok());
    });
  }
  for (auto& thread : threads) thread.join();
  const auto frames = TakeAll(reader.get());
  ASSERT_EQ(frames.size(), 200u);
  for (size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].job().priority(), static_cast<int>(i) + 1);
  }
}

TEST_F(JobFeedTest, JobReadAgainAsItWasIsNotToldAgain) {
  const auto reader = Open();
  Take(reader.get());
  ASSERT_TRUE(feed_->PublishRead([] { return MakeJob(Job::QUEUED); }).ok());
  EXPECT_FALSE(reader->Next(now_).frame.has_value());
  EXPECT_EQ(feed_->PublishRead([] { return absl::InternalError("disk"); }).status(),
            absl::InternalError("disk"));
  EXPECT_FALSE(reader->Next(now_).frame.has_value());
}

TEST_F(JobFeedTest, ClosedFeedEndsStreamsWithItsReason) {
  const auto reader = Open();
  Take(reader.get());
  feed_->Close(absl::UnavailableError("bye"));
  const auto end = reader->Next(now_).end;
  ASSERT_TRUE(end.has_value());
  EXPECT_TRUE(absl::IsUnavailable(*end));
}

TEST(PeerFeed, ReaderThatComesFromAPeerGetsTheWholeJobWithAGapAndLargerNumbers) {
  FrameCounter counter(7, true);
  const auto feed = std::make_shared<JobFeed>(MakeJob(Job::RUNNING), &counter);
  const auto bell = std::make_shared<Bell>();
  const auto at_home = FeedReader::Open(feed, 0, absl::ZeroDuration(), kManyReaders, bell);
  ASSERT_TRUE(at_home.ok());
  ASSERT_TRUE((*at_home)->Next(absl::Now()).frame.has_value());
  feed->PublishProgress(Iteration(1));
  const int64_t foreign_seq = counter.Next() + (int64_t{1} << 45);
  const auto reader = FeedReader::Open(feed, foreign_seq, absl::ZeroDuration(), kManyReaders, bell);
  ASSERT_TRUE(reader.ok()) << reader.status();
  const auto first = (*reader)->Next(absl::Now());
  ASSERT_TRUE(first.frame.has_value());
  EXPECT_TRUE(first.frame->has_job());
  EXPECT_TRUE(first.frame->gap());
  EXPECT_GT(first.frame->seq(), foreign_seq);
  feed->PublishProgress(Iteration(2));
  const auto second = (*reader)->Next(absl::Now());
  ASSERT_TRUE(second.frame.has_value());
  EXPECT_EQ(second.frame->progress().iteration(), 2);
  EXPECT_GT(second.frame->seq(), first.frame->seq());
  // A reader that was here before goes on as ever: with the newest of what it has not seen.
  const auto next = (*at_home)->Next(absl::Now());
  ASSERT_TRUE(next.frame.has_value());
  EXPECT_EQ(next.frame->progress().iteration(), 2);
}

TEST(PeerFeed, NumberThatNoServerCanHaveSentIsRefused) {
  FrameCounter counter(7, true);
  const auto feed = std::make_shared<JobFeed>(MakeJob(Job::RUNNING), &counter);
  const auto refused =
      FeedReader::Open(feed, FrameCounter::kMaxForeignSeq + 1, absl::ZeroDuration(), kManyReaders,
                       std::make_shared<Bell>());
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace amhex::server
