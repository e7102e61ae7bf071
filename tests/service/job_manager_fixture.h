// A job manager and a worker pool with real child processes that follow scripts.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "job.h"
#include "job_id.h"
#include "job_manager.h"
#include "service_fixtures.h"
#include "sqlite_job_store.h"
#include "worker_pool.h"

namespace amhex::server {

class JobManagerTest : public ::testing::Test {
 protected:
  void TearDown() override { Stop(absl::ZeroDuration()); }

  void Start(int worker_count = 1) {
    metrics_ = std::make_unique<Metrics>("test");
    auto store = SqliteJobStore::Open(folder_ / "jobs.db");
    auto blobs = BlobStore::Open(folder_.path(), options_.limits);
    ASSERT_TRUE(store.ok() && blobs.ok());
    options_.retry_delay = absl::Milliseconds(1);
    auto manager =
        JobManager::Create(options_, *std::move(store), *std::move(blobs), metrics_.get());
    ASSERT_TRUE(manager.ok()) << manager.status();
    manager_ = *std::move(manager);
    WorkerPool::Options pool_options;
    pool_options.command.path = AMHEX_SCRIPTED_WORKER;
    pool_options.worker_count = worker_count;
    pool_options.cuda_devices = cuda_devices_;
    pool_options.stop_patience = absl::Milliseconds(300);
    pool_options.decode_patience = absl::Seconds(2);
    pool_options.silence_patience = silence_patience_;
    pool_ = std::make_unique<WorkerPool>(pool_options, manager_.get());
    pool_->Start(nullptr);
  }

  void Stop(absl::Duration patience) {
    if (manager_) manager_->StartDraining();
    if (pool_) pool_->Stop(absl::Now() + patience);
    pool_.reset();
    manager_.reset();
    metrics_.reset();
  }

  // Submits and returns the id.
  std::string Submit(const std::string& script) {
    const auto job = manager_->Submit(Everyone(), ScriptRequest(script));
    EXPECT_TRUE(job.ok()) << job.status();
    return job.ok() ? JobIdFromName(job->name()) : "";
  }

  amhex::v1::Job Get(const std::string& id) {
    auto job = manager_->Get(Everyone(), id);
    EXPECT_TRUE(job.ok()) << job.status();
    return job.ok() ? *std::move(job) : amhex::v1::Job();
  }

  bool Reaches(const std::string& id, amhex::v1::Job::State state) {
    return Eventually([&] { return Get(id).state() == state; });
  }

  bool ReachesIteration(const std::string& id, int iteration) {
    return Eventually([&] { return Get(id).progress().iteration() == iteration; });
  }

  amhex::v1::Job Finished(const std::string& id) {
    EXPECT_TRUE(Eventually([&] { return IsFinal(Get(id).state()); }));
    return Get(id);
  }

  int LinesOf(const std::string& path) {
    std::ifstream file(path);
    int count = 0;
    for (std::string line; std::getline(file, line);) ++count;
    return count;
  }

  TemporaryFolder folder_;
  JobManager::Options options_;
  std::vector<std::string> cuda_devices_;
  absl::Duration silence_patience_ = absl::Minutes(1);
  std::unique_ptr<Metrics> metrics_;
  std::unique_ptr<JobManager> manager_;
  std::unique_ptr<WorkerPool> pool_;
};

}  // namespace amhex::server
