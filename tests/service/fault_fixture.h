// For tests of faults: whatever a test does to processes and connections, at its end nothing is
// lost, nothing doubled and nothing left over.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "daemon_fixture.h"
#include "leftovers.h"

namespace amhex::server {

constexpr absl::Duration kPatience = kCleaningPatience;

class FaultTest : public DaemonTest {
 protected:
  // Starts amhexd, waits for its workers and remembers what it holds then.
  void Start(const std::vector<std::string>& more = {});
  // Looks for what is left over, and ends the server.
  void TearDown() override;

  // Once every job is final and every client gone: the server holds what it held at its start, and
  // on disk is each job's input and result, once, and nothing else.
  void ExpectNothingLeftOver();
  // Ends the server with SIGTERM; it says 0 and takes its workers along.
  void ExpectCleanEnd();

  std::string Go() { return folder() / "go"; }
  void SayGo();
  std::vector<amhex::v1::Job> AllJobs();
  // The value on the metrics page of a metric without labels, or -1.
  double Metric(const std::string& name);

 private:
  void ExpectProcessAsAtStart();
  void ExpectFilesOfJobsOnly(const std::vector<amhex::v1::Job>& jobs);

  std::multiset<std::string> descriptors_at_start_;
  std::multiset<std::string> worker_descriptors_at_start_;
  size_t worker_count_ = 0;
};

}  // namespace amhex::server
