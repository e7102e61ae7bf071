// How many jobs per second the shared queue passes, against the number of nodes and the depth of
// the backlog, with a real PostgreSQL on this machine and workers that do nothing: each job is
// submitted, claimed, renewed once and finished, each step a durable transaction.
//
//   queue_benchmark [SECONDS_PER_ROW]     prints one JSON object per row
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "absl/time/clock.h"
#include "job_id.h"
#include "postgres_job_store.h"
#include "service/postgres_server.h"

namespace amhex::server {
namespace {

constexpr int kThreadsPerNode = 4;  // as many workers, each with a client that feeds it
constexpr absl::Duration kLease = absl::Seconds(30);
constexpr int64_t kNoLimit = 1'000'000'000;

NewJob MakeJob() {
  NewJob job;
  job.id = MakeUuid(absl::Now());
  job.request_id = job.id;
  job.request_hash = "hash";
  job.ttl = absl::Hours(1);
  job.job.set_priority(50);
  job.job.set_max_attempts(3);
  job.job.mutable_input()->set_sha256(job.id);
  job.job.mutable_input()->set_size_bytes(1);
  return job;
}

std::unique_ptr<PostgresJobStore> OpenStore(const std::string& url) {
  PostgresJobStore::Options options;
  options.url = url;
  options.address = "127.0.0.1:1";
  auto store = PostgresJobStore::Open(options);
  if (!store.ok()) {
    std::cerr << store.status() << "\n";
    std::exit(EXIT_FAILURE);
  }
  return *std::move(store);
}

// Jobs that wait behind those that are measured; written by the database itself.
void FillBacklog(const std::string& url, int depth) {
  const auto store = OpenStore(url);
  if (!store->Submit(MakeJob(), kNoLimit, absl::Now()).ok()) std::exit(EXIT_FAILURE);
  auto connection = PostgresConnection::Open(url, absl::Minutes(5));
  if (!connection.ok() ||
      !(*connection)
           ->Execute("INSERT INTO job(id, tenant, request_id, request_hash, state, queue_key,"
                     " memory_bytes, spec, input_sha256, create_time, not_before, ttl,"
                     " max_attempts) SELECT 'old' || i, tenant, 'old' || i, request_hash, 1,"
                     " queue_key + 1000000000000 + i, 0, spec, 'old' || i, create_time,"
                     " not_before, ttl, 3 FROM job, generate_series(1, " +
                     std::to_string(depth) + ") AS i; ANALYZE job")
           .ok()) {
    std::exit(EXIT_FAILURE);
  }
}

bool RunOneJob(PostgresJobStore* store, const std::string& worker) {
  if (!store->Submit(MakeJob(), kNoLimit, absl::Now()).ok()) return false;
  Claimant claimant;
  claimant.node = "node";
  claimant.worker = worker;
  claimant.lease = kLease;
  const auto claimed = store->Claim(claimant, absl::Now());
  if (!claimed.ok() || !claimed->has_value()) return false;
  const std::string& id = (*claimed)->id;
  const int64_t epoch = (*claimed)->epoch;
  FinalOutcome outcome;
  outcome.state = amhex::v1::Job::SUCCEEDED;
  outcome.details.mutable_result()->mutable_mesh()->set_sha256(id + "-mesh");
  return store->Heartbeat(id, epoch, absl::Now(), kLease).ok() &&
         store->Finish(id, epoch, outcome, absl::Now()).ok();
}

void Measure(int node_count, int backlog, absl::Duration duration) {
  const std::string url = SharedPostgres().MakeDatabase();
  FillBacklog(url, backlog);
  std::atomic<int64_t> done{0};
  std::atomic<int64_t> missed{0};
  const absl::Time start = absl::Now();
  {
    std::vector<std::unique_ptr<PostgresJobStore>> nodes;
    std::vector<std::jthread> threads;
    nodes.reserve(node_count);
    threads.reserve(size_t{kThreadsPerNode} * node_count);
    for (int node = 0; node < node_count; ++node) nodes.push_back(OpenStore(url));
    for (int i = 0; i < node_count * kThreadsPerNode; ++i) {
      threads.emplace_back([&, i] {
        PostgresJobStore* const store = nodes[static_cast<size_t>(i / kThreadsPerNode)].get();
        while (absl::Now() < start + duration) {
          ++(RunOneJob(store, std::to_string(i)) ? done : missed);
        }
      });
    }
  }
  const double seconds = absl::ToDoubleSeconds(absl::Now() - start);
  std::printf(R"({"nodes": %d, "backlog": %d, "jobs_per_second": %.1f, "missed": %lld})"
              "\n",
              node_count, backlog, static_cast<double>(done) / seconds,
              static_cast<long long>(missed));
  std::fflush(stdout);
}

}  // namespace
}  // namespace amhex::server

int main(int argc, char** argv) {
  const absl::Duration duration = absl::Seconds(argc > 1 ? std::atof(argv[1]) : 10);
  for (const int backlog : {0, 10'000, 100'000}) {
    for (const int nodes : {1, 2, 4}) amhex::server::Measure(nodes, backlog, duration);
  }
  return EXIT_SUCCESS;
}
