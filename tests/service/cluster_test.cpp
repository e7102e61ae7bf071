// Three amhexd on one PostgreSQL: any of them answers for all jobs, and none is needed.
#include <signal.h>

#include <filesystem>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "cluster_fixture.h"
#include "files.h"
#include "job_watcher.h"
#include "sha256.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;
using amhex::v1::WatchJobResponse;

using NodesTest = ClusterTest;

// Meshes in one call; the final job, and the mesh's bytes.
std::pair<Job, std::string> MeshInOneCall(const Node& node, const std::string& script) {
  grpc::ClientContext context;
  const auto stream = node.mesher().Mesh(&context);
  amhex::v1::MeshRequest request;
  *request.mutable_submit() = ScriptRequest(script);
  stream->Write(request);
  Job job;
  std::string mesh;
  for (amhex::v1::MeshResponse response; stream->Read(&response);) {
    if (response.watch().has_job()) job = response.watch().job();
    mesh += response.mesh().data();
  }
  const grpc::Status status = stream->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  return {job, mesh};
}

TEST_F(NodesTest, EveryNodeTellsTheProgressOfAJobThatOneOfThemRuns) {
  StartNodes(3);
  const std::string name = Submit(0, LongScript());
  std::vector<std::unique_ptr<JobWatcher>> watchers;
  for (const auto& node : nodes_) watchers.push_back(std::make_unique<JobWatcher>(*node, name));
  for (const auto& watcher : watchers) {
    EXPECT_TRUE(Eventually([&] { return watcher->progress_count() >= 5; }, absl::Minutes(1)));
  }
  Cancel(0, name);
  for (const auto& watcher : watchers) {
    watcher->Join();
    EXPECT_EQ(watcher->state(), Job::CANCELLED);
    EXPECT_TRUE(watcher->increasing());
  }
  for (const auto& node : nodes_) EXPECT_EQ(node->StateOf(name), Job::CANCELLED);
}

TEST_F(NodesTest, ManyWatchersOfAnotherNodesJobCostItOneStream) {
  StartNodes(2);
  const std::string name = Submit(0, LongScript());
  const int beside = NodeBeside(name);
  std::vector<std::unique_ptr<JobWatcher>> watchers;
  for (int i = 0; i < 10; ++i)
    watchers.push_back(std::make_unique<JobWatcher>(*nodes_[beside], name));
  for (const auto& watcher : watchers) {
    EXPECT_TRUE(Eventually([&] { return watcher->progress_count() > 0; }));
  }
  EXPECT_TRUE(Eventually([&] { return nodes_[beside]->Metric("amhex_watchers") == 10; }));
  EXPECT_TRUE(Eventually([&] { return nodes_[1 - beside]->Metric("amhex_watchers") == 1; }));
}

TEST_F(NodesTest, WatcherGoesOnAtAnotherNodeWhereItWasCutOff) {
  StartNodes(2);
  const std::string name = Submit(0, LongScript());
  const int beside = NodeBeside(name);
  int64_t seq = 0;
  {
    JobWatcher first(*nodes_[1 - beside], name);
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
  const std::string name = Submit(0, LongScript());
  const int beside = NodeBeside(name);
  Cancel(beside, name);
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

TEST_F(NodesTest, OneCallToANodeGivesTheMeshThatAnotherHasMade) {
  StartNodes(2);
  const std::string blocker = SubmitWaiting(0, "mesh");
  ASSERT_TRUE(HasStarted("mesh"));
  // The node that runs the blocker has no other worker.
  const auto [job, mesh] = MeshInOneCall(*nodes_[Runner(blocker)], "progress 1; large 3000000;");
  EXPECT_EQ(job.state(), Job::SUCCEEDED);
  EXPECT_EQ(mesh, std::string(3'000'000, 'x'));
  LetGo();
  EXPECT_TRUE(Reaches(0, blocker, Job::SUCCEEDED));
}

TEST_F(NodesTest, JobOfAKilledNodeIsDoneByAnotherWhileItIsWatched) {
  lease_seconds_ = kShortLeaseSeconds;
  StartNodes(3);
  const std::string name = SubmitWaiting(0, "mesh");
  ASSERT_TRUE(HasStarted("mesh"));
  const int runner = Runner(name);
  const int beside = (runner + 1) % 3;
  JobWatcher watcher(*nodes_[beside], name);
  nodes_[runner]->Kill();
  LetGo();
  watcher.Join();
  EXPECT_EQ(watcher.state(), Job::SUCCEEDED);
  Job job;
  ASSERT_TRUE(nodes_[beside]->Get(name, &job).ok());
  EXPECT_GE(job.attempt_count(), 2);
}

TEST_F(NodesTest, RestartedNodePutsItsOwnJobsBackAndLeavesThoseOfOthersAlone) {
  StartNodes(2);
  const std::string first = SubmitWaiting(0, "first");
  const std::string second = SubmitWaiting(0, "second");
  ASSERT_TRUE(HasStarted("first") && HasStarted("second"));
  const int runner = Runner(first);
  nodes_[runner]->Kill();
  nodes_[runner]->Start();
  LetGo();
  for (const std::string& name : {first, second}) {
    ASSERT_TRUE(Reaches(runner, name, Job::SUCCEEDED));
    Job job;
    ASSERT_TRUE(nodes_[runner]->Get(name, &job).ok());
    EXPECT_EQ(job.attempt_count(), 1);
  }
}

TEST_F(NodesTest, PausedNodeIsFencedWhenItWakes) {
  lease_seconds_ = kShortLeaseSeconds;
  StartNodes(2);
  const std::string name = SubmitWaiting(0, "mesh");
  ASSERT_TRUE(HasStarted("mesh"));
  const int runner = Runner(name);
  const int beside = 1 - runner;
  nodes_[runner]->Signal(SIGSTOP);
  EXPECT_TRUE(Eventually([&] { return RunnerOf(name) == beside; }, absl::Minutes(1)));
  EXPECT_GE(nodes_[beside]->Metric("amhex_lease_expired_total"), 1);
  LetGo();  // the paused node's worker is not paused, and ends as well
  EXPECT_TRUE(Reaches(beside, name, Job::SUCCEEDED));
  nodes_[runner]->Signal(SIGCONT);
  EXPECT_TRUE(Reaches(runner, name, Job::SUCCEEDED));
  Job job;
  ASSERT_TRUE(nodes_[runner]->Get(name, &job).ok());
  EXPECT_GE(job.attempt_count(), 2);
  const std::string next = Submit(runner, "succeed again;");
  EXPECT_TRUE(Reaches(runner, next, Job::SUCCEEDED));
}

TEST_F(NodesTest, DatabaseAwayIsUnavailableAndRunningJobsFinishWhenItIsBack) {
  StartNodes(2);
  const std::string name = SubmitWaiting(0, "mesh");
  ASSERT_TRUE(HasStarted("mesh"));
  SharedPostgres().Kill();
  LetGo();
  std::string refused;
  EXPECT_EQ(nodes_[0]->Submit(ScriptRequest("succeed mesh;"), &refused).error_code(),
            grpc::StatusCode::UNAVAILABLE);
  EXPECT_TRUE(Eventually([&] { return nodes_[0]->Metric("amhex_store_up") == 0; }));
  SharedPostgres().Start();
  EXPECT_TRUE(Reaches(1, name, Job::SUCCEEDED));
  EXPECT_TRUE(Eventually([&] { return nodes_[0]->Metric("amhex_store_up") == 1; }));
}

TEST_F(NodesTest, RestoredBackupHoldsTheSameJobsAndMeshes) {
  StartNodes(1);
  const auto list = [this] {
    grpc::ClientContext context;
    amhex::v1::ListJobsResponse response;
    EXPECT_TRUE(nodes_[0]->mesher().ListJobs(&context, {}, &response).ok());
    std::string text;
    for (const Job& job : response.jobs()) text += job.ShortDebugString() + "\n";
    return text;
  };
  for (const std::string mesh : {"first", "second", "third"}) {
    ASSERT_TRUE(Reaches(0, Submit(0, "succeed " + mesh + ";"), Job::SUCCEEDED));
  }
  ASSERT_TRUE(Reaches(0, Submit(0, "fail;"), Job::FAILED));
  const std::string before = list();
  // As docs/cluster.md says: the database first, then the folder, while the node runs.
  const std::string dump = folder_ / "dump.sql";
  ASSERT_TRUE(WriteFileAtomically(dump, "").ok());
  std::filesystem::permissions(folder_ / "", std::filesystem::perms::all);
  std::filesystem::permissions(dump, std::filesystem::perms::all);
  const std::string schema = database_.substr(database_.rfind("%3D") + 3);
  const std::string url = database_.substr(0, database_.rfind('?'));
  ASSERT_TRUE(SharedPostgres().RunProgram("pg_dump", url, {"-n", schema, "-f", dump}));
  std::filesystem::copy(folder_ / "data", folder_ / "copy",
                        std::filesystem::copy_options::recursive);
  // What comes later, and then everything, is lost.
  ASSERT_TRUE(Reaches(0, Submit(0, "succeed fourth;"), Job::SUCCEEDED));
  EXPECT_NE(list(), before);
  EXPECT_EQ(nodes_[0]->Terminate(), 0);
  std::filesystem::remove_all(folder_ / "data");
  ASSERT_TRUE(
      SharedPostgres().RunProgram("psql", url, {"-q", "-c", "DROP SCHEMA " + schema + " CASCADE"}));

  ASSERT_TRUE(
      SharedPostgres().RunProgram("psql", url, {"-q", "-v", "ON_ERROR_STOP=1", "-f", dump}));
  std::filesystem::rename(folder_ / "copy", folder_ / "data");
  nodes_[0]->Start();
  EXPECT_EQ(list(), before);
  Job job;
  ASSERT_TRUE(nodes_[0]->Get(Submit(0, "succeed first;"), &job).ok());
  EXPECT_TRUE(Reaches(0, job.name(), Job::SUCCEEDED));
}

TEST_F(NodesTest, SecondNodeOfTheSameNameIsRefused) {
  StartNodes(1);
  const std::string command =
      absl::StrCat(AMHEX_DAEMON, " --listen ", OwnAddress(), ":", NextPort(),
                   " --metrics-listen '' --store '", database_, "' --node-name node0 --data-dir ",
                   folder_ / "data", " --worker ", AMHEX_SCRIPTED_WORKER, " 2>/dev/null");
  EXPECT_NE(std::system(command.c_str()), 0);
}

}  // namespace
}  // namespace amhex::server
