// What kills workers is refused for a while, and nothing else is.
#include "input_quarantine.h"

#include <gtest/gtest.h>

#include <string>

#include "errors.h"
#include "job_manager_fixture.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

constexpr absl::Duration kHour = absl::Hours(1);

class InputQuarantineTest : public ::testing::Test {
 protected:
  bool Refuses(const std::string& key, absl::Time when) const {
    const absl::Status status = quarantine_.Check(key, when);
    EXPECT_EQ(ReasonOf(status), status.ok() ? "" : "INPUT_QUARANTINED");
    return !status.ok();
  }

  const absl::Time now_ = absl::Now();
  InputQuarantine quarantine_{3, kHour};
};

TEST_F(InputQuarantineTest, RefusesFromTheLastDeathThatIsPermittedUntilTheTimeIsOver) {
  EXPECT_FALSE(Refuses("bad", now_));
  for (int death = 1; death <= 4; ++death) {
    const absl::Time when = now_ + death * absl::Minutes(1);
    quarantine_.NoteDeaths("bad", 1, when);
    EXPECT_EQ(Refuses("bad", when), death >= 3);
    EXPECT_EQ(Refuses("bad", when + kHour - absl::Nanoseconds(1)), death >= 3);
    EXPECT_FALSE(Refuses("bad", when + kHour));
    EXPECT_FALSE(Refuses("other", when));
  }
}

TEST_F(InputQuarantineTest, SuccessAndTimeForgiveWhatWasCounted) {
  quarantine_.NoteDeaths("lucky", 2, now_);
  quarantine_.Forgive("lucky");
  quarantine_.NoteDeaths("lucky", 2, now_);
  EXPECT_FALSE(Refuses("lucky", now_));
  quarantine_.NoteDeaths("rare", 2, now_);
  quarantine_.NoteDeaths("rare", 2, now_ + kHour);
  EXPECT_FALSE(Refuses("rare", now_ + kHour));
}

TEST_F(InputQuarantineTest, WithoutADurationNothingIsRefused) {
  InputQuarantine none(3, absl::ZeroDuration());
  none.NoteDeaths("bad", 100, now_);
  EXPECT_TRUE(none.Check("bad", now_).ok());
}

TEST_F(InputQuarantineTest, OldestOfTooManyAreForgiven) {
  for (size_t i = 0; i <= InputQuarantine::kMaxKeys; ++i) {
    quarantine_.NoteDeaths(std::to_string(i), 3, now_ + absl::Nanoseconds(i));
  }
  EXPECT_FALSE(Refuses("0", now_));
  EXPECT_TRUE(Refuses("1", now_));
  EXPECT_TRUE(Refuses(std::to_string(InputQuarantine::kMaxKeys), now_));
}

// The same on jobs and workers that die.
class QuarantinedJobTest : public JobManagerTest {
 protected:
  std::string Reason(const absl::StatusOr<Job>& submitted) { return ReasonOf(submitted.status()); }
  std::string EndOf(const std::string& id) { return ReasonOf(Finished(id).error()); }

  const std::string log_ = folder_ / "log";
  const std::string deadly_ = "progress 1; touch " + log_ + "; kill;";
};

TEST_F(QuarantinedJobTest, JobsEqualToOneThatKilledItsWorkersAreRefused) {
  Start();
  auto request = ScriptRequest(deadly_);
  request.set_request_id("6b1fa3a6-4c2f-4b86-9a52-0d7f6f2b2a10");
  const auto first = manager_->Submit(Everyone(), request);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(EndOf(JobIdFromName(first->name())), "ATTEMPTS_EXHAUSTED");
  EXPECT_EQ(Reason(manager_->Submit(Everyone(), ScriptRequest(deadly_))), "INPUT_QUARANTINED");
  // A repetition of the call still gives the job.
  const auto repeated = manager_->Submit(Everyone(), request);
  ASSERT_TRUE(repeated.ok()) << repeated.status();
  EXPECT_EQ(repeated->name(), first->name());
  // Other inputs, parameters and tenants are welcome, even if their workers die as well.
  EXPECT_EQ(Finished(Submit("succeed mesh;")).state(), Job::SUCCEEDED);
  auto gentler = ScriptRequest(deadly_);
  gentler.mutable_params()->mutable_sizing()->set_cell_count(20);
  Caller bob = Everyone();
  bob.tenant.name = "bob";
  EXPECT_TRUE(manager_->Submit(Everyone(), gentler).ok());
  EXPECT_TRUE(manager_->Submit(bob, ScriptRequest(deadly_)).ok());
}

TEST_F(QuarantinedJobTest, EqualJobsThatWaitKillNoFurtherWorkers) {
  Start();
  const std::string go = folder_ / "go";
  const std::string blocker = Submit("progress 1; until " + go + "; succeed mesh;");
  ASSERT_TRUE(ReachesIteration(blocker, 1));
  std::vector<std::string> ids;
  for (int i = 0; i < 5; ++i) ids.push_back(Submit(deadly_));
  std::ofstream(go) << "x";
  std::map<std::string, int> ends;
  for (const std::string& id : ids) ++ends[EndOf(id)];
  EXPECT_EQ(ends["ATTEMPTS_EXHAUSTED"], 1);
  EXPECT_EQ(ends["INPUT_QUARANTINED"], 4);
  EXPECT_LT(LinesOf(log_), 5 * options_.limits.max_attempts);
}

TEST_F(QuarantinedJobTest, InputsThatKeepKillingTheDecoderAreRefused) {
  Start();
  for (int i = 0; i < options_.limits.max_attempts; ++i) {
    EXPECT_EQ(EndOf(Submit("decode; abort;")), "INPUT_DECODE_LIMIT");
  }
  EXPECT_EQ(Reason(manager_->Submit(Everyone(), ScriptRequest("decode; abort;"))),
            "INPUT_QUARANTINED");
}

}  // namespace
}  // namespace amhex::server
