// SQLite under the laws of a job store, and what only it must do.
#include "sqlite_job_store.h"

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
                    ->Execute("ALTER TABLE job DROP COLUMN expected_micros; PRAGMA user_version=2")
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

}  // namespace
}  // namespace amhex::server
