// Real amhexd processes on one real database, and ways to hurt them. Workers follow scripts.
#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <sys/types.h>

#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "amhex/v1/blob_service.grpc.pb.h"
#include "amhex/v1/meshing_service.grpc.pb.h"
#include "cuttable_proxy.h"
#include "postgres_server.h"
#include "service_fixtures.h"
#include "test_addresses.h"

namespace amhex::server {

// One amhexd. Its address stays the same over restarts.
class Node {
 public:
  struct Options {
    std::string name;
    std::string store;
    std::string folder;  // shared by all nodes
    int worker_count = 1;
    double lease_seconds = 30;
    std::string host = OwnAddress();
    std::vector<std::string> flags;
    // How the calls below reach it.
    std::shared_ptr<grpc::ChannelCredentials> credentials = grpc::InsecureChannelCredentials();
    std::string token;
    absl::Duration call_patience = absl::Minutes(1);
    // Run in the new process, before it becomes amhexd.
    std::function<void()> prepare;
  };

  explicit Node(const Options& options);
  ~Node();

  void Start();
  bool running() const { return pid_ != 0; }
  void Signal(int number) const { kill(pid_, number); }
  void Kill();
  // SIGTERM; returns the exit code.
  int Terminate();
  // kill -9 of one of its workers, if it has any.
  void KillWorker() const;

  // Once every job is final and every caller gone: the node holds what it held at its start, and
  // none of its files is unfinished. Sockets to the database, to the other nodes and to callers
  // come and go; a handful more are no leak, one per job or fault would be.
  void ExpectNothingLeftOver() const;

  const std::string& address() const { return address_; }
  // For calls that the caller makes itself: shows the token.
  void Introduce(grpc::ClientContext* context) const;
  // A metric without labels.
  double Metric(const std::string& name) const;
  amhex::v1::Mesher::Stub& mesher() const { return *mesher_; }
  amhex::v1::Blobs::Stub& blobs() const { return *blobs_; }

  // Calls; each fails after the options' patience.
  grpc::Status Submit(const amhex::v1::SubmitJobRequest& request, std::string* name) const;
  grpc::Status Get(const std::string& name, amhex::v1::Job* job) const;
  amhex::v1::Job::State StateOf(const std::string& name) const;

 private:
  const Options options_;
  int metrics_port_ = 0;
  std::string address_;
  pid_t pid_ = 0;
  std::multiset<std::string> descriptors_at_start_;
  std::unique_ptr<amhex::v1::Mesher::Stub> mesher_;
  std::unique_ptr<amhex::v1::Blobs::Stub> blobs_;
};

// A script that shows progress for minutes. Two with different meshes make two jobs.
std::string LongScript(const std::string& mesh = "mesh");

class ClusterTest : public ::testing::Test {
 protected:
  // Short, for tests that wait until leases end. A busy machine may let others end, too: then jobs
  // run more often, and must still end once.
  static constexpr double kShortLeaseSeconds = 2;

  // Nodes named node0, node1, ... that all reach the database directly.
  void StartNodes(int count, int worker_count = 1);
  Node::Options NodeOptions(int number) const;
  // Node that runs the job, or -1.
  int RunnerOf(const std::string& name);
  // The node that runs the job, once one does; and another one.
  int Runner(const std::string& name);
  int NodeBeside(const std::string& name);

  // What callers do at a node of this number; each returns when it is so, or fails.
  std::string Submit(int node, const std::string& script);
  void Cancel(int node, const std::string& name);
  bool Reaches(int node, const std::string& name, amhex::v1::Job::State state);

  // A job that says that it runs, and ends with the text `mesh` when all such jobs are let go.
  std::string SubmitWaiting(int node, const std::string& mesh);
  bool HasStarted(const std::string& mesh);
  void LetGo();

  // No node has anything left over, and on disk is what these jobs need, and nothing else.
  void ExpectNothingLeftOver(const std::vector<amhex::v1::Job>& jobs);

  const std::string database_ = SharedPostgres().MakeDatabase();
  TemporaryFolder folder_;
  // Of the nodes that NodeOptions describes.
  double lease_seconds_ = 30;
  absl::Duration call_patience_ = absl::Minutes(1);
  std::vector<std::unique_ptr<Node>> nodes_;
};

}  // namespace amhex::server
