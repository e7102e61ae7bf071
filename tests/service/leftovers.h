// What faults must not leave behind, for tests of one server and of many: files that no job needs,
// descriptors, processes, watchers.
#pragma once

#include <sys/types.h>

#include <set>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "amhex/v1/job.pb.h"

namespace amhex::server {

// How long a server may take to clean up behind a fault.
constexpr absl::Duration kCleaningPatience = absl::Seconds(120);

// The names of all regular files below a folder.
std::multiset<std::string> FilesIn(const std::string& folder);

// The kinds of the open descriptors of a process: paths, and "socket:" once for each.
std::multiset<std::string> DescriptorKinds(pid_t pid);

// The same of all processes below one, together.
std::multiset<std::string> DescriptorKindsBelow(pid_t parent);

// Below `blobs` lies each job's input and result, once, whole, and nothing else.
void ExpectBlobsOfJobsOnly(const std::string& blobs, const std::vector<amhex::v1::Job>& jobs);

// The folder of what is not complete: no worker's file, no upload.
void ExpectNothingUnfinished(const std::string& private_folder);

// The process comes back to so many children, and to descriptors of which it had as many at its
// start; of sockets it may have `more_sockets` besides.
void ExpectProcessAsBefore(pid_t pid, size_t child_count, std::multiset<std::string> descriptors,
                           int more_sockets = 0);

// The processes below come back to descriptors of which they had as many at their start.
void ExpectWorkersAsBefore(pid_t parent, const std::multiset<std::string>& descriptors);

}  // namespace amhex::server
