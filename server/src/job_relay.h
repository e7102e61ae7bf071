// Follows jobs that run on other nodes of a cluster, so that every node can answer for all jobs.
#pragma once

#include <memory>
#include <string>

#include "job_feed.h"

namespace amhex::server {

// Thread-safe.
class JobRelay {
 public:
  virtual ~JobRelay() = default;

  // Copies what the node at `address` tells of a job into `feed`, through one stream however many
  // readers the feed has, until the job is final there, the node cannot be reached, or the feed has
  // no readers. Does nothing while that stream lasts; replaces one from another node.
  virtual void Follow(const std::string& job_id, const std::string& address,
                      std::shared_ptr<JobFeed> feed) = 0;
  // Ends the following of a job: nothing reaches its feed once it has returned.
  virtual void Unfollow(const std::string& job_id) = 0;
  // Ends all streams, and returns when none is left. Nothing can be followed any more.
  virtual void Stop() = 0;
};

}  // namespace amhex::server
