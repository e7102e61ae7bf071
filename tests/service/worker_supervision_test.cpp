// What workers' deaths mean, and which jobs run beside which.
#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>
#include <unistd.h>

#include <fstream>

#include "errors.h"
#include "job_manager_fixture.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

class WorkerSupervisionTest : public JobManagerTest {
 protected:
  // While it is there, workers die in the trial job.
  const std::string fault_ = folder_ / "fault";

  void SetUp() override { setenv("AMHEX_SCRIPTED_FAULT", fault_.c_str(), 1); }
  void TearDown() override {
    JobManagerTest::TearDown();
    unsetenv("AMHEX_SCRIPTED_FAULT");
  }
};

TEST_F(WorkerSupervisionTest, ManyInputsThatKillTheWorkerDoNotKeepItFromTheNextJob) {
  Start();
  std::vector<std::string> bad;
  for (int i = 0; i < 12; ++i) bad.push_back(Submit("progress 1; abort; " + std::to_string(i)));
  for (const std::string& id : bad) EXPECT_EQ(ReasonOf(Finished(id).error()), "ATTEMPTS_EXHAUSTED");
  // 36 deaths in a row: had each doubled the wait for the next worker, this job would not come to
  // run while the test waits.
  EXPECT_EQ(Finished(Submit("succeed mesh;")).state(), Job::SUCCEEDED);
  EXPECT_EQ(pool_->quarantined_count(), 0);
}

TEST_F(WorkerSupervisionTest, WorkerThatFailsTheTrialIsHeldBackUntilItPasses) {
  std::ofstream(fault_) << "x";
  options_.limits.max_attempts = 100;
  Start();
  const std::string id = Submit("progress 1; once " + (folder_ / "a") + "; once " +
                                (folder_ / "b") + "; once " + (folder_ / "c") + "; succeed mesh;");
  ASSERT_TRUE(Eventually([&] { return pool_->quarantined_count() == 1; }));
  // No worker is said to be ready, and the job waits for one without spending attempts.
  EXPECT_EQ(pool_->ready_count(), 0);
  EXPECT_EQ(metrics_->workers_quarantined.Value(), 1);
  EXPECT_EQ(Get(id).state(), Job::QUEUED);
  EXPECT_EQ(Get(id).attempt_count(), 3);
  unlink(fault_.c_str());
  EXPECT_EQ(Finished(id).state(), Job::SUCCEEDED);
  EXPECT_EQ(Get(id).attempt_count(), 4);
  EXPECT_EQ(pool_->quarantined_count(), 0);
}

TEST_F(WorkerSupervisionTest, AnEstimateForWhichNoWorkerStartsMayBeTriedAgain) {
  Start();
  for (const char* program : {"/bin/false", "/nowhere/amhex-worker"}) {
    WorkerPool::Options options;
    options.command.path = program;
    WorkerPool pool(options, manager_.get());
    const absl::Status status = pool.Estimate({}).status();
    EXPECT_TRUE(absl::IsUnavailable(status)) << status;
    EXPECT_EQ(ReasonOf(ToRpcStatus(status)), "SERVER_FAULT");
  }
}

TEST_F(WorkerSupervisionTest, EachWorkerInTurnSeesOneOfTheDevices) {
  setenv("CUDA_VISIBLE_DEVICES", "7", 1);
  cuda_devices_ = {"2", "GPU-b"};
  Start(3);
  EXPECT_TRUE(Eventually([&] { return pool_->ready_count() == 3; }));
  std::vector<std::string> seen;
  for (const pid_t pid : pool_->pids()) {
    std::ifstream variables("/proc/" + std::to_string(pid) + "/environ");
    for (std::string variable; std::getline(variables, variable, '\0');) {
      if (variable.starts_with("CUDA_VISIBLE_DEVICES=")) seen.push_back(variable);
    }
  }
  unsetenv("CUDA_VISIBLE_DEVICES");
  const std::string name = "CUDA_VISIBLE_DEVICES=";
  EXPECT_EQ(seen, (std::vector<std::string>{name + "2", name + "GPU-b", name + "2"}));
}

TEST_F(WorkerSupervisionTest, StoppingDoesNotWaitForAQuarantinedWorker) {
  std::ofstream(fault_) << "x";
  options_.limits.max_attempts = 100;
  Start();
  Submit("progress 1; abort;");
  ASSERT_TRUE(Eventually([&] { return pool_->quarantined_count() == 1; }));
  Stop(absl::ZeroDuration());
  EXPECT_EQ(pool_, nullptr);
}

TEST_F(WorkerSupervisionTest, FrozenWorkerIsReplacedAndItsJobRunsAgain) {
  silence_patience_ = absl::Seconds(2);
  Start();
  const std::string go = folder_ / "go";
  const std::string id = Submit("progress 1; until " + go + "; succeed mesh;");
  ASSERT_TRUE(ReachesIteration(id, 1));
  kill(pool_->pids().at(0), SIGSTOP);
  ASSERT_TRUE(Eventually([&] { return Get(id).attempt_count() == 2; }, absl::Minutes(1)));
  std::ofstream(go) << "x";
  EXPECT_EQ(Finished(id).state(), Job::SUCCEEDED);
  EXPECT_GE(metrics_->WorkerRestarts("silence").Value(), 1);
}

TEST_F(WorkerSupervisionTest, WorkerThatSaysNothingNewButLivesKeepsItsJob) {
  silence_patience_ = absl::Seconds(3);
  Start();
  const std::string id = Submit("progress 1; deaf 8000; succeed mesh;");
  EXPECT_TRUE(Eventually([&] { return IsFinal(Get(id).state()); }, absl::Minutes(1)));
  EXPECT_EQ(Get(id).state(), Job::SUCCEEDED);
  EXPECT_EQ(Get(id).attempt_count(), 1);
}

// Predicts one byte and one second per wanted cell; parameters with an edge length do not tell.
ExpectedCost PredictForTest(const amhex::v1::MeshingParams& params, int64_t) {
  const int64_t cells = params.sizing().edge_length() > 0 ? 0 : params.sizing().cell_count();
  return {cells, absl::Seconds(cells)};
}

class AdmissionTest : public JobManagerTest {
 protected:
  void StartWith(int64_t budget, int64_t worker_bytes, int worker_count) {
    options_.limits.max_running_memory_bytes = budget;
    options_.limits.max_worker_memory_bytes = worker_bytes;
    options_.predict_cost = PredictForTest;
    options_.unknown_memory_bytes = budget / worker_count;
    Start(worker_count);
  }

  absl::StatusOr<Job> SubmitSized(const std::string& script, int64_t bytes) {
    auto request = ScriptRequest(script);
    request.mutable_params()->mutable_sizing()->set_cell_count(bytes);
    return manager_->Submit(Everyone(), request);
  }
  static std::string IdOf(const absl::StatusOr<Job>& job) { return JobIdFromName(job->name()); }
};

// Runs until the file at `path` is there.
std::string UntilThere(const std::string& path) {
  return "progress 1; until " + path + "; succeed mesh;";
}

TEST_F(AdmissionTest, SmallJobsShareTheMemoryAndLargeOnesWaitForIt) {
  StartWith(100, 100, 3);
  const std::string go = folder_ / "go";
  const auto first = SubmitSized(UntilThere(go), 40);
  const auto second = SubmitSized(UntilThere(go), 40);
  ASSERT_TRUE(first.ok() && second.ok());
  // Two fit beside each other; the third has a worker of its own but no memory.
  ASSERT_TRUE(ReachesIteration(IdOf(first), 1));
  ASSERT_TRUE(ReachesIteration(IdOf(second), 1));
  const auto large = SubmitSized("succeed mesh;", 90);
  ASSERT_TRUE(large.ok());
  EXPECT_EQ(large->expected_memory_bytes(), 90);
  // One that fits overtakes it, which shows that the third worker looks for jobs.
  const auto small = SubmitSized("succeed mesh;", 10);
  EXPECT_EQ(Finished(IdOf(small)).state(), Job::SUCCEEDED);
  EXPECT_EQ(Get(IdOf(large)).state(), Job::QUEUED);
  EXPECT_TRUE(Eventually([&] { return metrics_->memory_reserved_bytes.Value() == 80; }));
  std::ofstream(go) << "x";
  EXPECT_EQ(Finished(IdOf(large)).state(), Job::SUCCEEDED);
  EXPECT_TRUE(Eventually([&] { return metrics_->memory_reserved_bytes.Value() == 0; }));
}

TEST_F(AdmissionTest, MetricTellsWhatTheQueueIsExpectedToCost) {
  StartWith(100, 100, 1);
  const std::string go = folder_ / "go";
  const auto running = SubmitSized(UntilThere(go), 10);
  ASSERT_TRUE(running.ok());
  ASSERT_TRUE(Eventually([&] { return Get(IdOf(running)).state() == Job::RUNNING; }));
  const auto first = SubmitSized("succeed mesh;", 20), second = SubmitSized("succeed mesh;", 30);
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_TRUE(Eventually([&] { return metrics_->queue_cost_seconds.Value() == 50; }));
  std::ofstream(go) << "x";
  EXPECT_EQ(Finished(IdOf(second)).state(), Job::SUCCEEDED);
  EXPECT_TRUE(Eventually([&] { return metrics_->queue_cost_seconds.Value() == 0; }));
}

TEST_F(AdmissionTest, JobThatNeverFitsIsRefusedWithBothNumbers) {
  StartWith(1000, 200, 1);
  const auto refused = SubmitSized("succeed mesh;", 201);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(ReasonOf(refused.status()), "OUT_OF_MEMORY");
  const std::string message(refused.status().message());
  EXPECT_NE(message.find("201"), std::string::npos) << message;
  EXPECT_NE(message.find("200"), std::string::npos) << message;
  EXPECT_TRUE(SubmitSized("succeed mesh;", 200).ok());
}

TEST_F(AdmissionTest, WhereOnlyTheGeometryTellsAShareIsSetAside) {
  StartWith(90, 0, 3);
  auto request = ScriptRequest("succeed mesh;");
  request.mutable_params()->mutable_sizing()->set_edge_length(0.5);
  const auto job = manager_->Submit(Everyone(), request);
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->expected_memory_bytes(), 30);
  EXPECT_EQ(Finished(JobIdFromName(job->name())).state(), Job::SUCCEEDED);
}

}  // namespace
}  // namespace amhex::server
