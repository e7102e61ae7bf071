// SQLite under the laws of a job store, and what only it must do.
#include "sqlite_job_store.h"

#include <time.h>

#include <atomic>
#include <thread>

#include "errors.h"
#include "files.h"
#include "job_record.h"
#include "job_store_laws.h"
#include "service_fixtures.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

class FilePlace : public StorePlace {
 public:
  absl::StatusOr<std::unique_ptr<JobStore>> Open() override {
    return SqliteJobStore::Open(folder_ / "jobs.db");
  }

 private:
  TemporaryFolder folder_;
};

class MemoryPlace : public StorePlace {
 public:
  absl::StatusOr<std::unique_ptr<JobStore>> Open() override {
    return SqliteJobStore::Open(":memory:");
  }
};

StoreKind Sqlite() {
  return {"Sqlite", [] { return std::make_unique<FilePlace>(); },
          [] { return std::make_unique<MemoryPlace>(); }, 2000};
}

INSTANTIATE_TEST_SUITE_P(Sqlite, JobStoreLaws, ::testing::Values(Sqlite()),
                         [](const auto& kind) { return kind.param.name; });

// The schema of the first release, as far as a row needs it.
constexpr char kVersion1[] = R"sql(
CREATE TABLE job (number INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE,
  request_id TEXT UNIQUE, request_hash TEXT NOT NULL, state INTEGER NOT NULL,
  priority INTEGER NOT NULL, spec BLOB NOT NULL, outcome BLOB, input_sha256 TEXT NOT NULL,
  result_sha256 TEXT, create_time INTEGER NOT NULL, not_before INTEGER NOT NULL,
  queue_deadline INTEGER, start_time INTEGER, end_time INTEGER, expire_time INTEGER,
  ttl INTEGER NOT NULL, attempt INTEGER NOT NULL DEFAULT 0, max_attempts INTEGER NOT NULL,
  lease_epoch INTEGER NOT NULL DEFAULT 0, lease_owner TEXT, lease_until INTEGER,
  cancel_requested INTEGER NOT NULL DEFAULT 0);
CREATE INDEX job_state ON job(state);
CREATE INDEX job_claim ON job(priority, number) WHERE state = 1;
CREATE INDEX job_lease ON job(lease_until) WHERE state = 2;
CREATE INDEX job_expire ON job(expire_time) WHERE state >= 3;
CREATE INDEX job_input ON job(input_sha256);
CREATE INDEX job_result ON job(result_sha256) WHERE result_sha256 IS NOT NULL;
CREATE TABLE generation (only_row INTEGER PRIMARY KEY CHECK (only_row = 1),
                         number INTEGER NOT NULL);
INSERT INTO generation VALUES (1, 7);
INSERT INTO job(id, request_hash, state, priority, spec, input_sha256, create_time, not_before, ttl,
                max_attempts, attempt) VALUES
  ('queued', 'h', 1, 50, x'', 'in', 2000000, 0, 60, 3, 0),
  ('running', 'h', 2, 50, x'', 'in', 1000000, 0, 60, 3, 1);
INSERT INTO job(id, request_hash, state, priority, spec, input_sha256, result_sha256, create_time,
                not_before, end_time, expire_time, ttl, max_attempts) VALUES
  ('done', 'h', 3, 50, x'', 'in', 'out', 500000, 0, 600000, 900000, 60, 3);
PRAGMA user_version=1;
)sql";

TEST(SqliteJobStore, QueueOfTheFirstReleaseGoesOn) {
  TemporaryFolder folder;
  {
    auto database = SqliteDatabase::Open(folder / "jobs.db");
    ASSERT_TRUE(database.ok() && (*database)->Execute(kVersion1).ok());
  }
  for (int opening = 0; opening < 2; ++opening) {
    auto store = SqliteJobStore::Open(folder / "jobs.db");
    ASSERT_TRUE(store.ok()) << store.status();
    EXPECT_EQ((*store)->Get("queued")->state(), Job::QUEUED);
    EXPECT_EQ((*store)->Get("running")->state(), Job::QUEUED);
    EXPECT_EQ((*store)->Get("done")->state(), Job::SUCCEEDED);
    EXPECT_TRUE(*(*store)->OwnsBlob("default", "out"));
  }
  auto store = SqliteJobStore::Open(folder / "jobs.db");
  ASSERT_TRUE(store.ok());
  EXPECT_EQ(*(*store)->NextGeneration(), 8);
  const auto claimed = (*store)->Claim(AnyJob(), absl::Now());
  ASSERT_TRUE(claimed.ok() && claimed->has_value());
  EXPECT_EQ((*claimed)->id, "running");
}

TEST(SqliteJobStore, QueueThatKnowsNoCostsGoesOnAndLearnsThem) {
  TemporaryFolder folder;
  NewJob fresh;
  fresh.id = "waiting";
  fresh.job.set_max_attempts(3);
  fresh.cost.duration = absl::Minutes(1);
  ASSERT_TRUE((*SqliteJobStore::Open(folder / "jobs.db"))->Submit(fresh, 10, absl::Now()).ok());
  {
    auto database = SqliteDatabase::Open(folder / "jobs.db");
    ASSERT_TRUE(database.ok());
    ASSERT_TRUE((*database)
                    ->Execute("DROP INDEX job_oldest; ALTER TABLE job DROP COLUMN expected_micros; "
                              "PRAGMA user_version=2")
                    .ok());
  }
  auto store = SqliteJobStore::Open(folder / "jobs.db");
  ASSERT_TRUE(store.ok()) << store.status();
  EXPECT_EQ((*store)->Get("waiting")->state(), Job::QUEUED);
  EXPECT_EQ(*(*store)->QueuedCost(), absl::ZeroDuration());
  fresh.id = "next";
  ASSERT_TRUE((*store)->Submit(fresh, 10, absl::Now()).ok());
  EXPECT_EQ(*(*store)->QueuedCost(), absl::Minutes(1));
}

TEST(SqliteJobStore, QueueOfALaterReleaseIsRefused) {
  TemporaryFolder folder;
  {
    auto database = SqliteDatabase::Open(folder / "jobs.db");
    ASSERT_TRUE(database.ok() && (*database)->Execute("PRAGMA user_version=1000").ok());
  }
  EXPECT_EQ(SqliteJobStore::Open(folder / "jobs.db").status().code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST(SqliteJobStore, QueueThatAnotherProcessHoldsIsUnavailableUntilItLetsGo) {
  TemporaryFolder folder;
  const auto store = *SqliteJobStore::Open(folder / "jobs.db");
  NewJob job;
  job.id = "job";
  job.job.set_max_attempts(1);
  const auto other = *SqliteDatabase::Open(folder / "jobs.db");
  ASSERT_TRUE(other->Execute("BEGIN IMMEDIATE").ok());
  const absl::Status held = store->Submit(job, 10, absl::Now()).status();
  EXPECT_TRUE(absl::IsUnavailable(held)) << held;
  EXPECT_EQ(ReasonOf(held), "STORE_UNAVAILABLE");
  EXPECT_TRUE(absl::IsNotFound(store->Get("job").status()));  // reading goes on
  ASSERT_TRUE(other->Execute("ROLLBACK").ok());
  EXPECT_TRUE(store->Submit(job, 10, absl::Now()).ok());
}

TEST(SqliteJobStore, QuotasHoldHoweverManySubmitAtOnce) {
  const auto store = *SqliteJobStore::Open(":memory:");
  std::atomic<int> accepted{0};
  std::vector<std::thread> callers;
  for (int caller = 0; caller < 4; ++caller) {
    callers.emplace_back([&, caller] {
      for (int i = 0; i < 20; ++i) {
        NewJob job;
        job.id = std::to_string(20 * caller + i);
        job.tenant.max_queued_jobs = 30;
        const auto submitted = store->Submit(job, kManyJobs, absl::Now());
        if (submitted.ok()) ++accepted;
        EXPECT_TRUE(submitted.ok() || ReasonOf(submitted.status()) == "QUOTA_EXCEEDED");
      }
    });
  }
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(accepted, 30);
}

TEST(SqliteJobStore, DamagedQueueIsAnErrorAndNotAnEmptyQueue) {
  TemporaryFolder folder;
  const std::string path = folder / "jobs.db";
  NewJob job;
  job.job.set_max_attempts(1);
  {
    const auto store = *SqliteJobStore::Open(path);
    for (int i = 0; i < 200; ++i) {
      job.id = std::to_string(i);
      ASSERT_TRUE(store->Submit(job, 1000, absl::Now()).ok());
    }
  }
  const std::string whole = *ReadWholeFile(path);
  const auto is_fault = [](const absl::Status& status) {
    return status.code() == absl::StatusCode::kInternal;
  };
  // No database at all; the beginning of one; one whose pages are overwritten.
  ASSERT_TRUE(WriteFileAtomically(path, std::string(whole.size(), 'x')).ok());
  EXPECT_TRUE(is_fault(SqliteJobStore::Open(path).status()));
  ASSERT_TRUE(WriteFileAtomically(path, whole.substr(0, whole.size() / 4)).ok());
  const auto cut = SqliteJobStore::Open(path);
  EXPECT_TRUE(is_fault(cut.ok() ? (*cut)->CountByState().status() : cut.status()));
  constexpr size_t kHeaderPage = 4096;
  ASSERT_TRUE(WriteFileAtomically(
                  path, whole.substr(0, kHeaderPage) + std::string(whole.size() - kHeaderPage, 'x'))
                  .ok());
  const auto overwritten = SqliteJobStore::Open(path);
  EXPECT_TRUE(is_fault(overwritten.ok() ? (*overwritten)->Submit(job, 1000, absl::Now()).status()
                                        : overwritten.status()));
}

// What a week leaves behind: jobs that succeeded, and what their tenant owns.
constexpr int kManyOldJobCount = 50'000;
constexpr char kManyOldJobs[] = R"sql(
WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 50000)
INSERT INTO job(id, tenant, request_hash, cache_key, state, queue_key, memory_bytes, spec, outcome,
                input_sha256, result_sha256, create_time, not_before, start_time, end_time,
                expire_time, ttl, attempt, max_attempts)
  SELECT 'old' || i, 'default', 'hash', 'old key' || i, 3, i, 0, x'', x'', 'old input' || i,
         'old result' || i, i, i, i, i, 9000000000000000, 1, 1, 1 FROM n;
INSERT INTO blob_owner SELECT tenant, input_sha256, 1, create_time FROM job WHERE id LIKE 'old%';
)sql";

// One statement without its index reads all of them, and all callers wait for it.
TEST(SqliteJobStore, CallsCostNoMoreWhereManyJobsAreRemembered) {
  TemporaryFolder folder;
  std::unique_ptr<JobStore> store = *SqliteJobStore::Open(folder / "jobs.db");
  absl::Time now = absl::FromUnixSeconds(1'700'000'000);
  int count = 0;
  const auto run_one = [&] {
    NewJob job;
    job.id = std::to_string(++count);
    job.cache_key = "key" + job.id;
    job.tenant.max_queued_jobs = 10;
    job.ttl = absl::Hours(1000);
    job.job.set_max_attempts(1);
    job.job.mutable_input()->set_sha256("input" + job.id);
    now += absl::Milliseconds(1);
    ASSERT_TRUE(store->Submit(job, kManyJobs, now).ok());
    const auto claimed = store->Claim(AnyJob(), now);
    ASSERT_TRUE(claimed.ok() && claimed->has_value());
    ASSERT_TRUE(store->Heartbeat(job.id, (*claimed)->epoch, now, kLease).ok());
    ASSERT_TRUE(store->Finish(job.id, (*claimed)->epoch, Outcome(Job::SUCCEEDED), now).ok());
    ASSERT_TRUE(store->ExpireQueued(Outcome(Job::FAILED), now).ok());
    ASSERT_TRUE(store->ReapExpiredLeases(now).ok());
    ASSERT_TRUE(store->RemoveExpired(now).ok());
    ASSERT_TRUE(store->OldestQueued().ok() && store->QueuedCost().ok());
  };
  // Of processor time, as others use the machine too.
  const auto cost = [&] {
    const clock_t begin = clock();
    for (int i = 0; i < 20; ++i) run_one();
    return clock() - begin;
  };
  cost();
  const clock_t with_few = cost();
  store.reset();
  ASSERT_TRUE((*SqliteDatabase::Open(folder / "jobs.db"))->Execute(kManyOldJobs).ok());
  store = *SqliteJobStore::Open(folder / "jobs.db");
  cost();
  // Far from what noise does, and from the dozens that a single such statement costs.
  EXPECT_LT(cost(), 4 * with_few);
}

// The oldest of all is looked for; pages on the way to it are empty, and none looks at all jobs.
TEST(SqliteJobStore, RareLabelBehindManyJobsIsFoundPageByPage) {
  TemporaryFolder folder;
  std::unique_ptr<JobStore> store = *SqliteJobStore::Open(folder / "jobs.db");
  NewJob red;
  red.id = "red";
  red.job.set_name(JobName(red.id));
  (*red.job.mutable_labels())["colour"] = "red";
  ASSERT_TRUE(store->Submit(red, kManyJobs, absl::FromUnixSeconds(1)).ok());
  store.reset();
  ASSERT_TRUE((*SqliteDatabase::Open(folder / "jobs.db"))->Execute(kManyOldJobs).ok());
  store = *SqliteJobStore::Open(folder / "jobs.db");
  JobQuery query;
  query.page_size = 1;
  query.labels = {{"colour", "red"}};
  int pages = 0;
  JobPage page;
  do {
    page = *store->List(query);
    query.before_number = page.next_before_number;
    ++pages;
  } while (page.jobs.empty() && query.before_number != 0);
  EXPECT_EQ(pages, kManyOldJobCount / kMaxListRows + 1);
  ASSERT_EQ(page.jobs.size(), 1U);
  EXPECT_EQ(page.jobs[0].labels().at("colour"), "red");
}

// A row with nothing but what a page looks at.
struct PlainRow {
  int64_t number = 0;
  std::string spec;
  int64_t IntColumn(int column) const { return column == kNumber ? number : int64_t{Job::QUEUED}; }
  std::string TextColumn(int column) const { return column == kSpec ? spec : ""; }
  bool IsNull(int) const { return true; }
};

TEST(JobPageMaker, PageEndsAfterSoManyRowsAndTheNextGoesOn) {
  Job red;
  (*red.mutable_labels())["colour"] = "red";
  JobQuery query;
  query.page_size = 1;
  query.labels = {{"colour", "red"}};
  int64_t number = 2 * kMaxListRows;
  JobPageMaker first(&query);
  while (first.ShowRow(PlainRow{number, ""})) --number;
  JobPage page = first.page();
  EXPECT_TRUE(page.jobs.empty());
  EXPECT_EQ(page.next_before_number, number + 1);
  EXPECT_EQ(number, kMaxListRows);
  query.before_number = page.next_before_number;
  JobPageMaker second(&query);
  EXPECT_EQ(second.before(), query.before_number);
  EXPECT_TRUE(second.ShowRow(PlainRow{number, red.SerializeAsString()}));
  EXPECT_EQ(second.page().jobs.size(), 1U);
}

}  // namespace
}  // namespace amhex::server
