// The laws of a durable queue. Every implementation of JobStore instantiates JobStoreLaws (see
// sqlite_job_store_test.cpp), and so passes the tests of job_store_laws.cpp (attempts and leases),
// job_store_sharing.cpp (tenants, fairness, memory, shared results, blobs) and
// job_store_simulation.cpp (random histories).
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <ostream>
#include <string>

#include "job_store.h"

namespace amhex::server {

// Where a store keeps its jobs; outlives the stores opened on it.
class StorePlace {
 public:
  virtual ~StorePlace() = default;
  virtual absl::StatusOr<std::unique_ptr<JobStore>> Open() = 0;
};

struct StoreKind {
  std::string name;
  // A fresh, empty place whose jobs survive closing and opening.
  std::function<std::unique_ptr<StorePlace>()> make_durable;
  // The same for random histories, where speed counts and nothing is opened twice.
  std::function<std::unique_ptr<StorePlace>()> make_quick;
  int simulated_histories = 0;
};

inline void PrintTo(const StoreKind& kind, std::ostream* out) { *out << kind.name; }

inline constexpr absl::Duration kLease = absl::Seconds(30);
inline constexpr int64_t kManyJobs = 1000;
inline constexpr char kNode[] = "node";

inline FinalOutcome Outcome(amhex::v1::Job::State state) {
  FinalOutcome outcome;
  outcome.state = state;
  if (state == amhex::v1::Job::SUCCEEDED) {
    outcome.details.mutable_result()->mutable_mesh()->set_sha256("result");
    outcome.details.mutable_result()->mutable_mesh()->set_size_bytes(100);
  } else {
    outcome.details.mutable_error()->set_code(1);
  }
  return outcome;
}

inline Claimant AnyJob() {
  Claimant claimant;
  claimant.node = kNode;
  claimant.worker = "worker";
  claimant.lease = kLease;
  return claimant;
}

// A store, opened as often as a test wants, and a clock that only the test moves.
class JobStoreLaws : public ::testing::TestWithParam<StoreKind> {
 protected:
  void SetUp() override;
  void Reopen();

  NewJob Make(int priority = 50);
  NewJob MakeFor(const std::string& tenant);
  // Submits and returns the id.
  std::string Submit(const NewJob& job);
  ClaimedJob Claim(const Claimant& claimant = AnyJob());
  bool NothingToClaim(const Claimant& claimant = AnyJob());
  // Claims the next job and ends it after `span`; returns its tenant.
  std::string RunNext(absl::Duration span);
  // True if a blob cannot be collected.
  bool IsUsed(const std::string& sha256);
  amhex::v1::Job::State StateOf(const std::string& id);

  std::unique_ptr<StorePlace> place_;
  absl::Time now_ = absl::FromUnixSeconds(1'700'000'000);
  std::unique_ptr<JobStore> store_;
};

}  // namespace amhex::server
