#include "leftovers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <iterator>

#include "absl/strings/str_join.h"
#include "files.h"
#include "process_view.h"
#include "service_fixtures.h"
#include "sha256.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

constexpr char kSocket[] = "socket:";

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

std::multiset<std::string> DescriptorKinds(pid_t pid) {
  std::multiset<std::string> kinds;
  // The numbers of sockets differ from one moment to the next.
  for (const std::string& what : DescriptorsOf(pid)) kinds.insert(what.substr(0, what.find('[')));
  return kinds;
}

std::multiset<std::string> DescriptorKindsBelow(pid_t parent) {
  std::multiset<std::string> kinds;
  for (const pid_t child : ChildrenOf(parent)) {
    kinds.merge(DescriptorKinds(child));
    kinds.merge(DescriptorKindsBelow(child));
  }
  return kinds;
}

void ExpectBlobsOfJobsOnly(const std::string& blobs, const std::vector<Job>& jobs) {
  std::set<std::string> due;
  for (const Job& job : jobs) {
    due.insert(job.input().sha256());
    if (job.state() == Job::SUCCEEDED) due.insert(job.result().mesh().sha256());
  }
  const auto there = FilesIn(blobs);
  EXPECT_EQ(std::multiset<std::string>(due.begin(), due.end()), there);
  for (const std::string& name : there) {
    const auto bytes = ReadWholeFile(blobs + "/" + name.substr(0, 2) + "/" + name);
    ASSERT_TRUE(bytes.ok()) << bytes.status();
    EXPECT_EQ(Sha256Hex(*bytes), name);
  }
}

void ExpectNothingUnfinished(const std::string& private_folder) {
  std::multiset<std::string> files;
  EXPECT_TRUE(Eventually(
      [&] {
        files = FilesIn(private_folder + "/scratch");
        return files.empty();
      },
      kCleaningPatience))
      << absl::StrJoin(files, ", ");
  files = FilesIn(private_folder + "/uploads");
  EXPECT_TRUE(files.empty()) << absl::StrJoin(files, ", ");
}

void ExpectProcessAsBefore(pid_t pid, size_t child_count, std::multiset<std::string> descriptors,
                           int more_sockets) {
  EXPECT_TRUE(Eventually([&] { return ChildrenOf(pid).size() == child_count; }, kCleaningPatience));
  for (int i = 0; i < more_sockets; ++i) descriptors.insert(kSocket);
  std::string surplus;
  EXPECT_TRUE(Eventually(
      [&] {
        surplus = Surplus(DescriptorKinds(pid), descriptors);
        return surplus.empty();
      },
      kCleaningPatience))
      << "still open: " << surplus;
}

void ExpectWorkersAsBefore(pid_t parent, const std::multiset<std::string>& descriptors) {
  std::string surplus;
  EXPECT_TRUE(Eventually(
      [&] {
        surplus = Surplus(DescriptorKindsBelow(parent), descriptors);
        return surplus.empty();
      },
      kCleaningPatience))
      << "still open in workers: " << surplus;
}

}  // namespace amhex::server
