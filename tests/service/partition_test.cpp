// A cluster on networks whose cables are pulled: packets are lost, and nobody is told.
#include <atomic>
#include <iostream>
#include <thread>

#include "amhex/client.h"
#include "cluster_fixture.h"
#include "files.h"
#include "job_watcher.h"
#include "network_lab.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

constexpr absl::Duration kPatience = absl::Minutes(1);

// A base of its own, for it must come before ClusterTest starts the database.
class Lab {
 protected:
  Lab() { InLab(); }
  static bool InLab() {
    static const bool kIsPermitted = [] {
      const bool is_inside = EnterNetworkLab();
      if (is_inside) SetOwnAddress("10.77.0.1");  // the database's
      return is_inside;
    }();
    return kIsPermitted;
  }
};

class PartitionTest : protected Lab, public ClusterTest {
 protected:
  void SetUp() override {
    if (!InLab()) GTEST_SKIP() << "needs root, and a kernel with network namespaces and bridges";
    lease_seconds_ = kShortLeaseSeconds;
    for (int number = 0; number < 2; ++number) {
      machines_.push_back(std::make_unique<LabMachine>(2 + number));
      Node::Options options = NodeOptions(number);
      options.host = machines_.back()->address();
      options.flags = {"--insecure"};
      options.prepare = [machine = machines_.back().get()] { machine->Enter(); };
      nodes_.push_back(std::make_unique<Node>(options));
    }
  }

  // Ends the nodes before their machines.
  void TearDown() override { nodes_.clear(); }

  std::vector<std::unique_ptr<LabMachine>> machines_;
};

TEST_F(PartitionTest, NodeCutOffFromTheDatabaseLosesItsJobAndCannotEndIt) {
  const std::string name = SubmitWaiting(0, "mesh");
  ASSERT_TRUE(HasStarted("mesh"));
  const int runner = Runner(name);
  machines_[runner]->Pull(Network::kDatabase);
  ASSERT_TRUE(Eventually([&] { return RunnerOf(name) == 1 - runner; }, kPatience));
  std::string refused;
  EXPECT_EQ(nodes_[runner]->Submit(ScriptRequest("succeed other;"), &refused).error_code(),
            grpc::StatusCode::UNAVAILABLE);
  LetGo();  // both workers end; the first one's node cannot say so
  ASSERT_TRUE(Reaches(1 - runner, name, Job::SUCCEEDED));
  Job before;
  ASSERT_TRUE(nodes_[1 - runner]->Get(name, &before).ok());
  EXPECT_GE(before.attempt_count(), 2);

  machines_[runner]->Plug(Network::kDatabase);
  ASSERT_TRUE(Reaches(runner, name, Job::SUCCEEDED));
  EXPECT_TRUE(Reaches(runner, Submit(runner, "succeed next;"), Job::SUCCEEDED));
  Job after;
  ASSERT_TRUE(nodes_[runner]->Get(name, &after).ok());
  EXPECT_EQ(after.end_time().seconds(), before.end_time().seconds());
  EXPECT_EQ(after.attempt_count(), before.attempt_count());
}

TEST_F(PartitionTest, NodeCutOffFromTheOthersEndsItsJobAndTheyTellSo) {
  const std::string name = SubmitWaiting(0, "mesh");
  ASSERT_TRUE(HasStarted("mesh"));
  const int runner = Runner(name);
  JobWatcher watcher(*nodes_[1 - runner], name);
  ASSERT_TRUE(Eventually([&] { return watcher.state() == Job::RUNNING; }, kPatience));
  machines_[runner]->Pull(Network::kCallers);
  LetGo();
  watcher.Join();
  EXPECT_EQ(watcher.state(), Job::SUCCEEDED);
  machines_[runner]->Plug(Network::kCallers);
  EXPECT_TRUE(Reaches(runner, name, Job::SUCCEEDED));
}

TEST_F(PartitionTest, CallerWhoseNodeIsCutOffGoesOnAtAnother) {
  const std::string name = SubmitWaiting(0, "mesh");
  ASSERT_TRUE(HasStarted("mesh"));
  const int runner = Runner(name);
  int64_t seq = 0;
  {
    const JobWatcher first(*nodes_[runner], name);
    ASSERT_TRUE(Eventually([&] { return first.state() == Job::RUNNING; }, kPatience));
    seq = first.last_seq();
    machines_[runner]->Pull(Network::kCallers);
  }
  grpc::ClientContext context;
  amhex::v1::WatchJobRequest request;
  request.set_name(name);
  request.set_after_seq(seq);
  const auto stream = nodes_[1 - runner]->mesher().WatchJob(&context, request);
  amhex::v1::WatchJobResponse frame;
  ASSERT_TRUE(stream->Read(&frame));
  EXPECT_EQ(frame.job().state(), Job::RUNNING);
  LetGo();
  while (stream->Read(&frame)) {
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(frame.job().state(), Job::SUCCEEDED);
}

// Nobody tells the client that its node is gone, and it has nothing to send: it has to ask.
TEST_F(PartitionTest, ClientLibraryNoticesThatItsNodeIsGoneAndGoesOnAtAnother) {
  const std::string name = SubmitWaiting(0, "mesh");
  ASSERT_TRUE(HasStarted("mesh"));
  client::ClientOptions options;
  options.address = "ipv4:" + nodes_[0]->address() + "," + nodes_[1]->address();
  std::atomic<bool> is_watching{false};
  std::atomic<bool> has_broken{false};
  std::atomic<bool> goes_on{false};
  absl::StatusOr<Job> final;
  std::jthread watching([&] {
    client::Client client(options);
    client::WatchOptions watch;
    watch.on_frame = [&](const amhex::v1::WatchJobResponse&) {
      (has_broken ? goes_on : is_watching) = true;
    };
    watch.on_reconnect = [&](const absl::Status&) { has_broken = true; };
    final = client.Watch(name, watch);
  });
  ASSERT_TRUE(Eventually([&] { return is_watching.load(); }, kPatience));
  ASSERT_FALSE(has_broken);
  machines_[0]->Pull(Network::kCallers);
  const absl::Time cut = absl::Now();
  ASSERT_TRUE(Eventually([&] { return goes_on.load(); }, kPatience));
  std::cout << "  goes on after " << absl::Now() - cut << "\n";
  LetGo();
  watching.join();
  ASSERT_TRUE(final.ok()) << final.status();
  EXPECT_EQ(final->state(), Job::SUCCEEDED);
}

}  // namespace
}  // namespace amhex::server
