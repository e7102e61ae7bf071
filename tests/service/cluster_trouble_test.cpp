// A cluster under load while everything that can break does.
#include <signal.h>

#include <filesystem>
#include <iostream>
#include <map>
#include <mutex>
#include <random>
#include <set>

#include "absl/strings/str_cat.h"
#include "amhex/client.h"
#include "cluster_fixture.h"
#include "job.h"
#include "job_id.h"
#include "postgres.h"
#include "sha256.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

constexpr int kSubmitters = 4;
constexpr int kJobsPerSubmitter = 250;
constexpr int kWorkers = 3;
// Far more than it takes: a minute on two cores that have nothing else to do.
constexpr absl::Duration kPatience = absl::Minutes(15);

// Notes every end of a job, and refuses changes of jobs that have ended.
constexpr char kWatchdog[] = R"sql(
CREATE TABLE ending (job_id text);
CREATE FUNCTION note_ending() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN
  INSERT INTO ending VALUES (NEW.id); RETURN NEW; END $$;
CREATE FUNCTION refuse_change() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN
  RAISE EXCEPTION 'job % has ended', OLD.id; END $$;
CREATE TRIGGER ended AFTER UPDATE ON job FOR EACH ROW
  WHEN (OLD.state < 3 AND NEW.state >= 3) EXECUTE FUNCTION note_ending();
CREATE TRIGGER over BEFORE UPDATE ON job FOR EACH ROW
  WHEN (OLD.state >= 3) EXECUTE FUNCTION refuse_change();
)sql";

class TroubleTest : public ClusterTest {
 protected:
  // Submits until some node has acknowledged the job, and notes its name and its mesh.
  void SubmitUntilAcknowledged(uint32_t seed) {
    std::mt19937 random(seed);
    for (int i = 0; i < kJobsPerSubmitter; ++i) {
      // However fast the machine is, everything breaks in the middle.
      while (i == kJobsPerSubmitter / 2 && !AllHasBroken() && absl::Now() < deadline_) {
        absl::SleepFor(absl::Milliseconds(20));
      }
      const std::string mesh = MakeUuid(absl::Now());
      amhex::v1::SubmitJobRequest request =
          ScriptRequest(absl::StrCat("progress 1; sleep 20; succeed ", mesh, ";"));
      request.set_request_id(MakeUuid(absl::Now()));
      std::string name;
      while (!nodes_[random() % nodes_.size()]->Submit(request, &name).ok()) {
        absl::SleepFor(absl::Milliseconds(20));
        if (absl::Now() > deadline_) return;
      }
      std::lock_guard<std::mutex> lock(mutex_);
      acknowledged_[name] = mesh;
    }
  }

  bool AllHasBroken() const { return database_restarted_ && hurt_count_ >= kHurtKinds; }

  size_t AcknowledgedCount() {
    std::lock_guard<std::mutex> lock(mutex_);
    return acknowledged_.size();
  }

  int64_t Count(const std::string& sql) {
    const auto connection = PostgresConnection::Open(database_, absl::Seconds(30));
    if (!connection.ok()) return -1;
    auto rows = (*connection)->Run(sql);
    return rows.ok() && rows->Next() ? rows->IntColumn(0) : -1;
  }

  // One misfortune after the other, to random nodes; the cluster is whole again when it returns.
  void Hurt(std::mt19937* random, CuttableProxy* proxy) {
    Node& victim = *nodes_[(*random)() % nodes_.size()];
    switch (hurt_count_ % kHurtKinds) {
      case 0:
        victim.Kill();
        absl::SleepFor(absl::Milliseconds(300));
        victim.Start();
        ++hurts_["node killed"];
        break;
      case 1:
        for (int i = 0; i < 5; ++i) {
          nodes_[(*random)() % nodes_.size()]->KillWorker();
          absl::SleepFor(absl::Milliseconds(50));
        }
        hurts_["worker killed"] += 5;
        break;
      case 2:
        victim.Signal(SIGSTOP);
        absl::SleepFor(kBeyondLease);
        victim.Signal(SIGCONT);
        ++hurts_["node paused beyond its lease"];
        break;
      default:
        proxy->Cut();
        absl::SleepFor(kBeyondLease);
        proxy->Mend();
        ++hurts_["node cut off from the database"];
    }
    ++hurt_count_;
  }

  static constexpr int kHurtKinds = 4;
  static constexpr absl::Duration kBeyondLease = absl::Milliseconds(3500);

  std::mutex mutex_;
  std::map<std::string, std::string> acknowledged_;  // name -> mesh
  std::map<std::string, int> hurts_;
  std::atomic<int> hurt_count_{0};
  std::atomic<bool> database_restarted_{false};
  absl::Time deadline_ = absl::Now() + kPatience;
};

TEST_F(TroubleTest, EveryAcknowledgedJobEndsOnceWhateverBreaks) {
  CuttableProxy proxy(SharedPostgres().host(), SharedPostgres().port());
  lease_seconds_ = kShortLeaseSeconds;
  call_patience_ = absl::Seconds(5);
  StartNodes(2, kWorkers);
  Node::Options cut_off = NodeOptions(2);
  cut_off.worker_count = kWorkers;
  const std::string direct =
      absl::StrCat("@", SharedPostgres().host(), ":", SharedPostgres().port(), "/");
  cut_off.store.replace(cut_off.store.find(direct), direct.size(),
                        absl::StrCat("@127.0.0.1:", proxy.port(), "/"));
  nodes_.push_back(std::make_unique<Node>(cut_off));
  ASSERT_TRUE((*PostgresConnection::Open(database_, absl::Seconds(30)))->Execute(kWatchdog).ok());

  std::vector<std::jthread> submitters;
  for (uint32_t i = 0; i < kSubmitters; ++i) {
    submitters.emplace_back([this, i] { SubmitUntilAcknowledged(i); });
  }
  constexpr size_t kAll = size_t{kSubmitters} * kJobsPerSubmitter;
  std::mt19937 random(1);
  while (absl::Now() < deadline_ &&
         (AcknowledgedCount() < kAll || Count("SELECT count(*) FROM job WHERE state < 3") != 0)) {
    if (!database_restarted_ && AcknowledgedCount() >= kAll / 4) {
      SharedPostgres().Kill();
      absl::SleepFor(absl::Seconds(1));
      SharedPostgres().Start();
      database_restarted_ = true;
      ++hurts_["database crashed"];
    }
    Hurt(&random, &proxy);
    absl::SleepFor(absl::Milliseconds(500));
  }
  for (std::jthread& submitter : submitters) submitter.join();

  for (const auto& [what, count] : hurts_) std::cout << "  " << what << ": " << count << "\n";
  EXPECT_TRUE(AllHasBroken());
  ASSERT_EQ(acknowledged_.size(), kAll);
  std::vector<Job> jobs;
  for (const auto& acknowledged : acknowledged_) {
    const auto& name = acknowledged.first;
    const auto& mesh = acknowledged.second;
    Job job;
    ASSERT_TRUE(Eventually([&] { return nodes_[0]->Get(name, &job).ok() && IsFinal(job.state()); }))
        << name << " is " << Job::State_Name(job.state());
    EXPECT_EQ(job.state(), Job::SUCCEEDED) << name << ": " << job.error().message();
    EXPECT_EQ(job.result().mesh().sha256(), Sha256Hex(mesh));
    jobs.push_back(job);
  }
  ExpectNothingLeftOver(jobs);
  EXPECT_EQ(Count("SELECT count(*) FROM job"), static_cast<int64_t>(kAll));
  EXPECT_EQ(Count("SELECT count(*) FROM ending"), static_cast<int64_t>(kAll));
  EXPECT_EQ(Count("SELECT count(DISTINCT job_id) FROM ending"), static_cast<int64_t>(kAll));
  EXPECT_EQ(Count("SELECT count(*) FROM lease"), 0);
}

TEST_F(TroubleTest, RollingRestartUnderLoadFailsNoCallOfAClient) {
  StartNodes(3);
  client::ClientOptions options;
  options.address = "ipv4:";
  for (const auto& node : nodes_) {
    absl::StrAppend(&options.address, node == nodes_.front() ? "" : ",", node->address());
  }
  std::atomic<bool> stopping{false};
  std::atomic<int> done{0};
  std::vector<std::jthread> threads;
  for (int thread = 0; thread < kSubmitters; ++thread) {
    threads.emplace_back([&] {
      client::Client client(options);
      while (!stopping) {
        const std::string mesh = MakeUuid(absl::Now());
        const client::EncodedInput input{
            amhex::v1::INPUT_ENCODING_ARRAYS,
            ScriptInput(absl::StrCat("progress 1; sleep 100; succeed ", mesh, ";"))};
        const auto job = client.Submit(input, {});
        ASSERT_TRUE(job.ok()) << job.status();
        const auto final = client.Watch(job->name(), {});
        ASSERT_TRUE(final.ok()) << final.status();
        ASSERT_EQ(final->state(), Job::SUCCEEDED) << final->error().message();
        EXPECT_EQ(final->attempt_count(), 1);
        const auto bytes = client.Download(final->result().mesh());
        ASSERT_TRUE(bytes.ok()) << bytes.status();
        EXPECT_EQ(*bytes, mesh);
        ++done;
      }
    });
  }
  for (int round = 0; round < 2; ++round) {
    for (const auto& node : nodes_) {
      const int before = done;
      EXPECT_EQ(node->Terminate(), 0);
      node->Start();
      EXPECT_TRUE(Eventually([&] { return done > before; }, absl::Minutes(3)));
    }
  }
  stopping = true;
  for (std::jthread& thread : threads) thread.join();
  for (const auto& node : nodes_) node->ExpectNothingLeftOver();
  std::cout << "  jobs done meanwhile: " << done << "\n";
}

}  // namespace
}  // namespace amhex::server
