// PostgreSQL under the laws of a job store, and what only it must do. The database is a real one.
#include "postgres_job_store.h"

#include <algorithm>
#include <atomic>
#include <fstream>
#include <set>
#include <string>
#include <thread>

#include "blob_store.h"
#include "errors.h"
#include "job_id.h"
#include "job_store_laws.h"
#include "postgres_server.h"
#include "service_fixtures.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

constexpr int kSimulatedHistories = 60;

PostgresJobStore::Options At(const std::string& url, const std::string& address = "here:1") {
  PostgresJobStore::Options options;
  options.url = url;
  options.address = address;
  return options;
}

class DatabasePlace : public StorePlace {
 public:
  absl::StatusOr<std::unique_ptr<JobStore>> Open() override {
    return PostgresJobStore::Open(At(url_));
  }

 private:
  const std::string url_ = SharedPostgres().MakeDatabase();
};

StoreKind Postgres() {
  const auto make = [] { return std::make_unique<DatabasePlace>(); };
  return {"Postgres", make, make, kSimulatedHistories};
}

INSTANTIATE_TEST_SUITE_P(Postgres, JobStoreLaws, ::testing::Values(Postgres()),
                         [](const auto& kind) { return kind.param.name; });

// Several nodes on one database.
class PostgresJobStoreTest : public ::testing::Test {
 protected:
  std::unique_ptr<PostgresJobStore> Open(const PostgresJobStore::Options& options) {
    auto store = PostgresJobStore::Open(options);
    EXPECT_TRUE(store.ok()) << store.status();
    return *std::move(store);
  }

  NewJob Make() {
    NewJob fresh;
    fresh.id = MakeUuid(absl::Now());
    fresh.request_hash = "hash";
    fresh.ttl = absl::Hours(1);
    fresh.job.set_max_attempts(3);
    fresh.job.mutable_input()->set_sha256("input");
    return fresh;
  }

  const std::string url_ = SharedPostgres().MakeDatabase();
};

TEST_F(PostgresJobStoreTest, NodesThatOpenAnEmptyDatabaseTogetherAgreeOnItsSchema) {
  std::vector<std::thread> threads;
  std::atomic<int> opened{0};
  for (int node = 0; node < 4; ++node) {
    threads.emplace_back([&] { opened += PostgresJobStore::Open(At(url_)).ok() ? 1 : 0; });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(opened, 4);
}

// A node of the earlier release runs on while the first of this one brings the schema up to date.
TEST_F(PostgresJobStoreTest, QueueThatKnowsNoCostsGoesOnAndLearnsThem) {
  Open(At(url_));
  auto connection = PostgresConnection::Open(url_, absl::Seconds(30));
  ASSERT_TRUE(connection.ok());
  ASSERT_TRUE((*connection)
                  ->Execute("ALTER TABLE job DROP COLUMN expected_micros;"
                            " UPDATE schema_version SET number = 1")
                  .ok());
  ASSERT_TRUE((*connection)
                  ->Execute("INSERT INTO job(id, tenant, request_hash, state, queue_key,"
                            " memory_bytes, spec, input_sha256, create_time, not_before, ttl,"
                            " max_attempts) VALUES ('old', 'default', 'hash', 1, 0, 0, '', 'input',"
                            " 0, 0, 60, 3)")
                  .ok());
  const auto store = Open(At(url_));
  EXPECT_EQ(*store->QueuedCost(), absl::ZeroDuration());
  NewJob fresh = Make();
  fresh.cost.duration = absl::Minutes(1);
  ASSERT_TRUE(store->Submit(fresh, kManyJobs, absl::Now()).ok());
  EXPECT_EQ(*store->QueuedCost(), absl::Minutes(1));
  EXPECT_EQ(store->Get("old")->state(), Job::QUEUED);
  ASSERT_TRUE((*connection)
                  ->Execute("INSERT INTO job(id, tenant, request_hash, state, queue_key,"
                            " memory_bytes, spec, input_sha256, create_time, not_before, ttl,"
                            " max_attempts) VALUES ('late', 'default', 'hash', 1, 0, 0, '',"
                            " 'input', 0, 0, 60, 3)")
                  .ok());
  EXPECT_EQ(*Open(At(url_))->QueuedCost(), absl::Minutes(1));
}

// What deploy/kubernetes/base/autoscaling.yaml asks, in its order.
TEST_F(PostgresJobStoreTest, QueriesOfTheAutoscalerTellTheCostOfTheQueueAndWhoIsNeeded) {
  std::vector<std::string> queries;
  std::ifstream manifest(AMHEX_AUTOSCALER);
  for (std::string line; std::getline(manifest, line);) {
    const size_t start = line.find("query: ");
    if (start != std::string::npos) queries.push_back(line.substr(start + 7));
  }
  ASSERT_EQ(queries.size(), 2U);
  const auto store = Open(At(url_));
  auto connection = PostgresConnection::Open(url_, absl::Seconds(30));
  ASSERT_TRUE(connection.ok());
  const auto answers = [&](int64_t cost, int64_t needed) {
    std::vector<int64_t> found;
    for (const std::string& query : queries) {
      auto rows = (*connection)->Run("SELECT answer::bigint FROM (" + query + ") AS one(answer)");
      ASSERT_TRUE(rows.ok() && rows->Next()) << query;
      found.push_back(rows->IntColumn(0));
      EXPECT_FALSE(rows->Next());
    }
    EXPECT_EQ(found, (std::vector<int64_t>{cost, needed}));
  };
  answers(0, 0);
  for (int i = 0; i < 3; ++i) {
    NewJob fresh = Make();
    fresh.cost.duration = absl::Minutes(10);
    ASSERT_TRUE(store->Submit(fresh, kManyJobs, absl::Now()).ok());
  }
  answers(1800, 1);
  Claimant claimant = AnyJob();
  for (int i = 0; i < 2; ++i) ASSERT_TRUE((*store->Claim(claimant, absl::Now())).has_value());
  answers(600, 3);
  ASSERT_TRUE((*store->Claim(claimant, absl::Now())).has_value());
  answers(0, 3);
}

TEST_F(PostgresJobStoreTest, LaterSchemaIsRefused) {
  Open(At(url_));
  auto connection = PostgresConnection::Open(url_, absl::Seconds(30));
  ASSERT_TRUE(connection.ok());
  ASSERT_TRUE((*connection)->Execute("UPDATE schema_version SET number = 1000").ok());
  EXPECT_EQ(PostgresJobStore::Open(At(url_)).status().code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST_F(PostgresJobStoreTest, ConcurrentClaimsTakeEveryJobOnce) {
  constexpr int kJobs = 200;
  constexpr int kClaimers = 6;
  const auto store = Open(At(url_));
  for (int i = 0; i < kJobs; ++i) ASSERT_TRUE(store->Submit(Make(), kManyJobs, absl::Now()).ok());
  std::mutex mutex;
  std::multiset<std::string> taken;
  std::vector<std::thread> threads;
  for (int claimer = 0; claimer < kClaimers; ++claimer) {
    threads.emplace_back([&, claimer] {
      const auto own = Open(At(url_));
      Claimant claimant = AnyJob();
      claimant.worker = std::to_string(claimer);
      // A claim that finds all rows locked by others takes nothing; the queue is empty only when
      // nobody takes anything any more.
      for (int misses = 0; misses < 20;) {
        const auto claimed = own->Claim(claimant, absl::Now());
        ASSERT_TRUE(claimed.ok()) << claimed.status();
        if (!claimed->has_value()) {
          ++misses;
          continue;
        }
        std::lock_guard<std::mutex> lock(mutex);
        taken.insert((*claimed)->id);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(taken.size(), static_cast<size_t>(kJobs));
  EXPECT_EQ(std::set<std::string>(taken.begin(), taken.end()).size(), static_cast<size_t>(kJobs));
}

TEST_F(PostgresJobStoreTest, TwinsNeverRunTogetherHoweverManyClaim) {
  const auto store = Open(At(url_));
  for (int i = 0; i < 8; ++i) {
    NewJob twin = Make();
    twin.cache_key = "same";
    ASSERT_TRUE(store->Submit(twin, kManyJobs, absl::Now()).ok());
  }
  std::atomic<int> taken{0};
  std::vector<std::thread> threads;
  for (int claimer = 0; claimer < 8; ++claimer) {
    threads.emplace_back([&] {
      const auto claimed = Open(At(url_))->Claim(AnyJob(), absl::Now());
      taken += claimed.ok() && claimed->has_value() ? 1 : 0;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(taken, 1);
}

TEST_F(PostgresJobStoreTest, TenantNeverRunsMoreThanItMayHoweverManyClaim) {
  const auto store = Open(At(url_));
  for (int i = 0; i < 8; ++i) {
    NewJob job = Make();
    job.tenant.max_running_jobs = 2;
    ASSERT_TRUE(store->Submit(job, kManyJobs, absl::Now()).ok());
  }
  std::atomic<int> taken{0};
  std::vector<std::thread> threads;
  for (int claimer = 0; claimer < 8; ++claimer) {
    threads.emplace_back([&] {
      const auto claimed = Open(At(url_))->Claim(AnyJob(), absl::Now());
      taken += claimed.ok() && claimed->has_value() ? 1 : 0;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(taken, 2);
}

TEST_F(PostgresJobStoreTest, SameRequestSubmittedThroughManyNodesIsOneJob) {
  std::atomic<int> fresh{0};
  std::mutex mutex;
  std::set<std::string> names;
  std::vector<std::thread> threads;
  for (int node = 0; node < 6; ++node) {
    threads.emplace_back([&] {
      NewJob job = Make();
      job.request_id = "request";
      const auto submitted = Open(At(url_))->Submit(job, kManyJobs, absl::Now());
      ASSERT_TRUE(submitted.ok()) << submitted.status();
      fresh += submitted->is_new ? 1 : 0;
      std::lock_guard<std::mutex> lock(mutex);
      names.insert(submitted->job.name());
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(fresh, 1);
  EXPECT_EQ(names.size(), 1u);
}

TEST_F(PostgresJobStoreTest, NodesWhoseClocksDisagreeAgreeOnLeases) {
  const auto punctual = Open(At(url_));
  PostgresJobStore::Options fast_options = At(url_);
  fast_options.clock = [] { return absl::Now() + absl::Hours(1); };
  const auto fast = Open(fast_options);
  const NewJob job = Make();
  ASSERT_TRUE(punctual->Submit(job, kManyJobs, absl::Now()).ok());
  const auto claimed = punctual->Claim(AnyJob(), absl::Now());
  ASSERT_TRUE(claimed.ok() && claimed->has_value());
  ASSERT_TRUE(fast->ReapExpiredLeases(fast_options.clock()).ok());
  EXPECT_EQ(punctual->Get(job.id)->state(), Job::RUNNING);
  ASSERT_TRUE(fast->ReapExpiredLeases(fast_options.clock() + kLease + absl::Seconds(1)).ok());
  EXPECT_EQ(punctual->Get(job.id)->state(), Job::QUEUED);
}

TEST_F(PostgresJobStoreTest, EveryNodeLearnsWhereAJobRuns) {
  const auto here = Open(At(url_, "here:1"));
  const auto there = Open(At(url_, "there:2"));
  const NewJob job = Make();
  ASSERT_TRUE(here->Submit(job, kManyJobs, absl::Now()).ok());
  EXPECT_EQ(*here->RunnerAddress(job.id), "");
  ASSERT_TRUE(there->Claim(AnyJob(), absl::Now())->has_value());
  EXPECT_EQ(*here->RunnerAddress(job.id), "there:2");
}

// Without CollectBlob's lock, and without looking again under it, this fails within a second.
TEST_F(PostgresJobStoreTest, NoSubmittedJobMissesItsInputWhileOtherNodesCollect) {
  constexpr int kRounds = 60;
  TemporaryFolder folder;
  std::atomic<bool> done{false};
  const auto collect = [&](const std::string& node) {
    ASSERT_TRUE(MakeFolders(folder / node).ok());
    const auto store = Open(At(url_, node));
    const auto blobs = *BlobStore::Open(folder.path(), Limits(), folder / node);
    const absl::Time future = absl::Now() + absl::Hours(1);  // nothing is too young
    while (!done) {
      ASSERT_TRUE(store->DropUnusedGrants(future).ok());
      blobs->Collect(future, future, [&](const std::string& sha256, const auto& hide) {
        const auto unused = store->CollectBlob(sha256, hide);
        return unused.ok() && *unused;
      });
    }
  };
  const auto submit = [&](const std::string& node) {
    ASSERT_TRUE(MakeFolders(folder / node).ok());
    const auto store = Open(At(url_, node));
    const auto blobs = *BlobStore::Open(folder.path(), Limits(), folder / node);
    store->CheckBlobsWith([&](const std::string& sha256) { return blobs->Contains(sha256); });
    for (int round = 0; round < kRounds; ++round) {
      NewJob job = Make();
      *job.job.mutable_input() = *blobs->Put("one of few inputs " + std::to_string(round % 2));
      const auto submitted = store->Submit(job, kManyJobs, absl::Now());
      if (!submitted.ok()) {
        EXPECT_EQ(ReasonOf(submitted.status()), "BLOB_MISSING");
        continue;
      }
      EXPECT_TRUE(blobs->Contains(job.job.input().sha256()));
      ASSERT_TRUE(store->RequestCancel(job.id, Outcome(Job::CANCELLED), absl::Now()).ok());
      EXPECT_TRUE(blobs->Contains(job.job.input().sha256()));
      ASSERT_TRUE(store->Delete(job.id).ok());
    }
  };
  std::jthread first_collector(collect, "node1");
  std::jthread second_collector(collect, "node2");
  {
    std::jthread first_submitter(submit, "node3");
    std::jthread second_submitter(submit, "node4");
  }
  done = true;
}

TEST_F(PostgresJobStoreTest, SubscribersHearOfChangesMadeByOthers) {
  const auto here = Open(At(url_));
  const auto there = Open(At(url_));
  std::mutex mutex;
  std::set<std::string> heard;
  here->Subscribe([&](const std::string& id) {
    std::lock_guard<std::mutex> lock(mutex);
    heard.insert(id);
  });
  const auto has = [&](const std::string& id) {
    std::lock_guard<std::mutex> lock(mutex);
    return heard.count(id) > 0;
  };
  ASSERT_TRUE(Eventually([&] { return has(""); }));
  const NewJob job = Make();
  ASSERT_TRUE(there->Submit(job, kManyJobs, absl::Now()).ok());
  EXPECT_TRUE(Eventually([&] { return has(job.id); }));
}

TEST_F(PostgresJobStoreTest, DatabaseThatStallsIsUnavailableAndComesBack) {
  PostgresJobStore::Options options = At(url_);
  options.patience = absl::Seconds(2);
  const auto store = Open(options);
  const NewJob job = Make();
  ASSERT_TRUE(store->Submit(job, kManyJobs, absl::Now()).ok());
  SharedPostgres().Kill();
  const auto refused = store->Submit(Make(), kManyJobs, absl::Now());
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(ReasonOf(refused.status()), "STORE_UNAVAILABLE");
  SharedPostgres().Start();
  EXPECT_TRUE(Eventually([&] { return store->Get(job.id).ok(); }));
  EXPECT_TRUE(store->Claim(AnyJob(), absl::Now())->has_value());
}

}  // namespace
}  // namespace amhex::server
