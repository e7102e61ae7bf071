#include "fault_fixture.h"

#include <signal.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fstream>

#include "job.h"
#include "leftovers.h"
#include "process_view.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

}  // namespace

void FaultTest::Start(const std::vector<std::string>& more) {
  DaemonTest::Start(more);
  const auto workers = std::find(more.begin(), more.end(), "--workers");
  worker_count_ = workers == more.end() ? 1 : std::stoul(*(workers + 1));
  ASSERT_TRUE(Eventually(
      [&] { return Metric("amhex_workers_ready") == static_cast<double>(worker_count_); },
      kPatience));
  AllJobs();  // over the connection that stays
  descriptors_at_start_ = DescriptorKinds(pid());
  worker_descriptors_at_start_ = DescriptorKindsBelow(pid());
}

void FaultTest::TearDown() {
  if (pid() != 0 && !HasFatalFailure()) {
    ExpectNothingLeftOver();
    ExpectCleanEnd();
  }
  DaemonTest::TearDown();
}

void FaultTest::SayGo() { std::ofstream(Go()) << "x"; }

std::vector<Job> FaultTest::AllJobs() {
  grpc::ClientContext context;
  amhex::v1::ListJobsRequest request;
  request.set_page_size(1000);
  amhex::v1::ListJobsResponse response;
  const auto status = mesher().ListJobs(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.next_page_token(), "");
  return {response.jobs().begin(), response.jobs().end()};
}

double FaultTest::Metric(const std::string& name) {
  const std::string page = MetricsPage();
  const size_t line = page.find("\n" + name + " ");
  return line == std::string::npos ? -1 : std::atof(page.c_str() + line + name.size() + 2);
}

void FaultTest::ExpectNothingLeftOver() {
  std::vector<Job> jobs;
  EXPECT_TRUE(Eventually(
      [&] {
        jobs = AllJobs();
        return std::all_of(jobs.begin(), jobs.end(),
                           [](const Job& job) { return IsFinal(job.state()); });
      },
      kPatience));
  ExpectFilesOfJobsOnly(jobs);
  ExpectProcessAsAtStart();
}

void FaultTest::ExpectFilesOfJobsOnly(const std::vector<Job>& jobs) {
  ExpectNothingUnfinished(folder() / "data");
  ExpectBlobsOfJobsOnly(folder() / "data/blobs", jobs);
}

void FaultTest::ExpectProcessAsAtStart() {
  EXPECT_TRUE(Eventually([&] { return Metric("amhex_watchers") == 0; }, kPatience))
      << Metric("amhex_watchers");
  ExpectProcessAsBefore(pid(), worker_count_, descriptors_at_start_);
  ExpectWorkersAsBefore(pid(), worker_descriptors_at_start_);
}

void FaultTest::ExpectCleanEnd() {
  const std::vector<pid_t> workers = ChildrenOf(pid());
  kill(pid(), SIGTERM);
  EXPECT_EQ(Wait(), 0);
  for (const pid_t worker : workers) {
    EXPECT_TRUE(Eventually([&] { return kill(worker, 0) != 0 && errno == ESRCH; }, kPatience));
  }
}

}  // namespace amhex::server
