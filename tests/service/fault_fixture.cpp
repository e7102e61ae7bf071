#include "fault_fixture.h"

#include <signal.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "absl/strings/str_join.h"
#include "files.h"
#include "job.h"
#include "process_view.h"
#include "sha256.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

// The kinds of the open descriptors: sockets differ from one moment to the next by their numbers.
std::multiset<std::string> KindsOfDescriptors(pid_t pid) {
  std::multiset<std::string> kinds;
  for (const std::string& what : DescriptorsOf(pid)) kinds.insert(what.substr(0, what.find('[')));
  return kinds;
}

std::string Surplus(const std::multiset<std::string>& have, const std::multiset<std::string>& due) {
  std::vector<std::string> more;
  std::set_difference(have.begin(), have.end(), due.begin(), due.end(), std::back_inserter(more));
  return absl::StrJoin(more, ", ");
}

}  // namespace

std::multiset<std::string> FilesIn(const std::string& folder) {
  std::multiset<std::string> names;
  std::error_code error;
  std::filesystem::recursive_directory_iterator entry(folder, error);
  for (; entry != std::filesystem::recursive_directory_iterator(); entry.increment(error)) {
    if (!entry->is_directory(error)) names.insert(entry->path().filename());
  }
  return names;
}

void FaultTest::Start(const std::vector<std::string>& more) {
  DaemonTest::Start(more);
  const auto workers = std::find(more.begin(), more.end(), "--workers");
  worker_count_ = workers == more.end() ? 1 : std::stoul(*(workers + 1));
  ASSERT_TRUE(Eventually(
      [&] { return Metric("amhex_workers_ready") == static_cast<double>(worker_count_); },
      kPatience));
  AllJobs();  // over the connection that stays
  descriptors_at_start_ = KindsOfDescriptors(pid());
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
  EXPECT_TRUE(Eventually([&] { return FilesIn(folder() / "data/scratch").empty(); }, kPatience));
  const auto uploads = FilesIn(folder() / "data/uploads");
  EXPECT_TRUE(uploads.empty()) << absl::StrJoin(uploads, ", ");
  std::set<std::string> due;
  for (const Job& job : jobs) {
    due.insert(job.input().sha256());
    if (job.state() == Job::SUCCEEDED) due.insert(job.result().mesh().sha256());
  }
  const auto blobs = FilesIn(folder() / "data/blobs");
  EXPECT_EQ(std::multiset<std::string>(due.begin(), due.end()), blobs);
  for (const std::string& name : blobs) {
    const auto bytes = ReadWholeFile(folder() / "data/blobs/" + name.substr(0, 2) + "/" + name);
    ASSERT_TRUE(bytes.ok()) << bytes.status();
    EXPECT_EQ(Sha256Hex(*bytes), name);
  }
}

void FaultTest::ExpectProcessAsAtStart() {
  EXPECT_TRUE(Eventually([&] { return ChildrenOf(pid()).size() == worker_count_; }, kPatience));
  EXPECT_TRUE(Eventually([&] { return Metric("amhex_watchers") == 0; }, kPatience))
      << Metric("amhex_watchers");
  std::string surplus;
  EXPECT_TRUE(Eventually(
      [&] {
        surplus = Surplus(KindsOfDescriptors(pid()), descriptors_at_start_);
        return surplus.empty();
      },
      kPatience))
      << "still open: " << surplus;
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
