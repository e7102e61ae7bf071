// Three amhexd on one PostgreSQL: any of them answers for all jobs, and none is needed.
#include <signal.h>

#include <set>

#include "absl/strings/str_cat.h"
#include "cluster_fixture.h"
#include "files.h"
#include "sha256.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;
using amhex::v1::WatchJobResponse;

// A script that shows progress for about `steps` tenths of a second.
std::string LongScript(int steps) {
  std::string script;
  for (int step = 1; step <= steps; ++step)
    absl::StrAppend(&script, "progress ", step, "; sleep 100;");
  return script + "succeed mesh;";
}

// Watches a job in a thread of its own.
class Watcher {
 public:
  Watcher(const Node& node, const std::string& name) {
    request_.set_name(name);
    thread_ = std::thread([this, &node] {
      auto stream = node.mesher().WatchJob(&context_, request_);
      WatchJobResponse frame;
      while (stream->Read(&frame)) {
        increasing_ = increasing_ && frame.seq() >= last_seq_;
        last_seq_ = frame.seq();
        progress_count_ += frame.has_progress() ? 1 : 0;
        if (frame.has_job()) state_ = frame.job().state();
      }
      status_ = stream->Finish();
    });
  }
  ~Watcher() {
    context_.TryCancel();
    if (thread_.joinable()) thread_.join();
  }
  void Join() { thread_.join(); }

  bool increasing() const { return increasing_; }
  int progress_count() const { return progress_count_; }
  Job::State state() const { return state_; }
  int64_t last_seq() const { return last_seq_; }

 private:
  grpc::ClientContext context_;
  amhex::v1::WatchJobRequest request_;
  std::atomic<bool> increasing_{true};
  std::atomic<int64_t> last_seq_{0};
  std::atomic<int> progress_count_{0};
  std::atomic<Job::State> state_{Job::STATE_UNSPECIFIED};
  grpc::Status status_;
  std::thread thread_;
};

class NodesTest : public ClusterTest {
 protected:
  std::string Submit(int node, const std::string& script) {
    std::string name;
    const grpc::Status status = nodes_[node]->Submit(ScriptRequest(script), &name);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return name;
  }
  bool Reaches(int node, const std::string& name, Job::State state) {
    return Eventually([&] { return nodes_[node]->StateOf(name) == state; }, absl::Seconds(30));
  }
  // A node other than the one that runs the job, once one does.
  int NodeBeside(const std::string& name) {
    EXPECT_TRUE(Eventually([&] { return RunnerOf(name) >= 0; }, absl::Seconds(30)));
    return (RunnerOf(name) + 1) % static_cast<int>(nodes_.size());
  }
};

TEST_F(NodesTest, EveryNodeTellsTheProgressOfAJobThatOneOfThemRuns) {
  StartNodes(3);
  const std::string name = Submit(0, LongScript(20));
  std::vector<std::unique_ptr<Watcher>> watchers;
  for (const auto& node : nodes_) watchers.push_back(std::make_unique<Watcher>(*node, name));
  for (const auto& watcher : watchers) {
    watcher->Join();
    EXPECT_EQ(watcher->state(), Job::SUCCEEDED);
    EXPECT_GE(watcher->progress_count(), 5);
    EXPECT_TRUE(watcher->increasing());
  }
  for (const auto& node : nodes_) EXPECT_EQ(node->StateOf(name), Job::SUCCEEDED);
}

TEST_F(NodesTest, ManyWatchersOfAnotherNodesJobCostItOneStream) {
  StartNodes(2);
  const std::string name = Submit(0, LongScript(50));
  const int beside = NodeBeside(name);
  std::vector<std::unique_ptr<Watcher>> watchers;
  for (int i = 0; i < 10; ++i) watchers.push_back(std::make_unique<Watcher>(*nodes_[beside], name));
  for (const auto& watcher : watchers) {
    EXPECT_TRUE(Eventually([&] { return watcher->progress_count() > 0; }));
  }
  EXPECT_TRUE(Eventually([&] { return nodes_[beside]->Metric("amhex_watchers") == 10; }));
  EXPECT_TRUE(Eventually([&] { return nodes_[1 - beside]->Metric("amhex_watchers") == 1; }));
}

TEST_F(NodesTest, WatcherGoesOnAtAnotherNodeWhereItWasCutOff) {
  StartNodes(2);
  const std::string name = Submit(0, LongScript(40));
  const int beside = NodeBeside(name);
  int64_t seq = 0;
  {
    Watcher first(*nodes_[1 - beside], name);
    ASSERT_TRUE(Eventually([&] { return first.progress_count() > 2; }));
    seq = first.last_seq();
  }
  for (const int node : {beside, 1 - beside}) {
    grpc::ClientContext context;
    amhex::v1::WatchJobRequest request;
    request.set_name(name);
    request.set_after_seq(seq);
    const auto stream = nodes_[node]->mesher().WatchJob(&context, request);
    WatchJobResponse frame;
    ASSERT_TRUE(stream->Read(&frame));
    EXPECT_TRUE(frame.has_job());
    EXPECT_GE(frame.seq(), seq);
    ASSERT_TRUE(stream->Read(&frame));
    seq = frame.seq();
    context.TryCancel();
  }
}

TEST_F(NodesTest, CancelThroughAnotherNodeStopsTheWorker) {
  StartNodes(3);
  const std::string name = Submit(0, LongScript(600));
  const int beside = NodeBeside(name);
  grpc::ClientContext context;
  amhex::v1::CancelJobRequest request;
  request.set_name(name);
  Job job;
  ASSERT_TRUE(nodes_[beside]->mesher().CancelJob(&context, request, &job).ok());
  EXPECT_TRUE(Reaches(beside, name, Job::CANCELLED));
}

TEST_F(NodesTest, InputUploadedToOneNodeIsMeshedThroughAnotherAndReadFromAThird) {
  StartNodes(3);
  const std::string input = ScriptInput("succeed the-mesh;");
  amhex::v1::BlobRef blob;
  blob.set_sha256(Sha256Hex(input));
  blob.set_size_bytes(static_cast<int64_t>(input.size()));
  {
    grpc::ClientContext context;
    amhex::v1::WriteBlobResponse response;
    const auto writer = nodes_[0]->blobs().WriteBlob(&context, &response);
    amhex::v1::WriteBlobRequest chunk;
    *chunk.mutable_blob() = blob;
    chunk.set_data(input);
    chunk.set_finish(true);
    writer->Write(chunk);
    writer->WritesDone();
    ASSERT_TRUE(writer->Finish().ok());
  }
  amhex::v1::SubmitJobRequest request = ScriptRequest("");
  *request.mutable_input_blob() = blob;
  std::string name;
  ASSERT_TRUE(nodes_[1]->Submit(request, &name).ok());
  ASSERT_TRUE(Reaches(2, name, Job::SUCCEEDED));
  Job job;
  ASSERT_TRUE(nodes_[2]->Get(name, &job).ok());
  grpc::ClientContext context;
  amhex::v1::ReadBlobRequest read;
  *read.mutable_blob() = job.result().mesh();
  const auto reader = nodes_[2]->blobs().ReadBlob(&context, read);
  amhex::v1::ReadBlobResponse part;
  ASSERT_TRUE(reader->Read(&part));
  EXPECT_EQ(part.data(), "the-mesh");
}

TEST_F(NodesTest, JobOfAKilledNodeIsDoneByAnotherWhileItIsWatched) {
  StartNodes(3);
  const std::string marker = folder_ / "marker";
  const std::string name =
      Submit(0, absl::StrCat("progress 1; touch ", marker, "; sleep 3000; succeed mesh;"));
  const int beside = NodeBeside(name);
  const int runner = RunnerOf(name);
  Watcher watcher(*nodes_[beside], name);
  ASSERT_TRUE(Eventually([&] { return ReadWholeFile(marker).ok(); }));
  nodes_[runner]->Kill();
  watcher.Join();
  EXPECT_EQ(watcher.state(), Job::SUCCEEDED);
  Job job;
  ASSERT_TRUE(nodes_[beside]->Get(name, &job).ok());
  EXPECT_EQ(job.attempt_count(), 2);
}

TEST_F(NodesTest, RestartedNodePutsItsOwnJobsBackAndLeavesThoseOfOthersAlone) {
  StartNodes(2);
  const std::string first = Submit(0, LongScript(30));
  const std::string second = Submit(0, LongScript(31));  // equal jobs would share one run
  ASSERT_TRUE(Reaches(0, first, Job::RUNNING) && Reaches(0, second, Job::RUNNING));
  const int runner = RunnerOf(first);
  nodes_[runner]->Kill();
  nodes_[runner]->Start();
  for (const std::string& name : {first, second}) {
    ASSERT_TRUE(Reaches(runner, name, Job::SUCCEEDED));
    Job job;
    ASSERT_TRUE(nodes_[runner]->Get(name, &job).ok());
    EXPECT_EQ(job.attempt_count(), 1);
  }
}

TEST_F(NodesTest, PausedNodeIsFencedWhenItWakes) {
  StartNodes(2);
  const std::string marker = folder_ / "runs";
  const std::string name =
      Submit(0, absl::StrCat("progress 1; touch ", marker, "; sleep 1500; succeed mesh;"));
  const int beside = NodeBeside(name);
  const int runner = RunnerOf(name);
  ASSERT_TRUE(Eventually([&] { return ReadWholeFile(marker).ok(); }));
  nodes_[runner]->Signal(SIGSTOP);
  EXPECT_TRUE(Reaches(beside, name, Job::SUCCEEDED));
  nodes_[runner]->Signal(SIGCONT);
  EXPECT_TRUE(Reaches(runner, name, Job::SUCCEEDED));
  Job job;
  ASSERT_TRUE(nodes_[runner]->Get(name, &job).ok());
  EXPECT_EQ(job.attempt_count(), 2);
  const std::string next = Submit(runner, "succeed again;");
  EXPECT_TRUE(Reaches(runner, next, Job::SUCCEEDED));
}

TEST_F(NodesTest, DatabaseAwayIsUnavailableAndRunningJobsFinishWhenItIsBack) {
  StartNodes(2);
  const std::string name = Submit(0, LongScript(10));
  ASSERT_TRUE(Reaches(0, name, Job::RUNNING));
  SharedPostgres().Kill();
  std::string refused;
  EXPECT_EQ(nodes_[0]->Submit(ScriptRequest("succeed mesh;"), &refused).error_code(),
            grpc::StatusCode::UNAVAILABLE);
  EXPECT_TRUE(Eventually([&] { return nodes_[0]->Metric("amhex_store_up") == 0; }));
  SharedPostgres().Start();
  EXPECT_TRUE(Reaches(1, name, Job::SUCCEEDED));
  EXPECT_TRUE(Eventually([&] { return nodes_[0]->Metric("amhex_store_up") == 1; }));
}

TEST_F(NodesTest, SecondNodeOfTheSameNameIsRefused) {
  StartNodes(1);
  const std::string command =
      absl::StrCat(AMHEX_DAEMON, " --listen 127.0.0.1:", FreePort(),
                   " --metrics-listen '' --store '", database_, "' --node-name node0 --data-dir ",
                   folder_ / "data", " --worker ", AMHEX_SCRIPTED_WORKER, " 2>/dev/null");
  EXPECT_NE(std::system(command.c_str()), 0);
}

}  // namespace
}  // namespace amhex::server
