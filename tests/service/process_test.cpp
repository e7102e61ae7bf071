// The real amhexd as a process: signals, kill -9, exit codes, health. Workers follow scripts.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "daemon_fixture.h"
#include "errors.h"
#include "files.h"
#include "health_client.h"
#include "job.h"
#include "process_view.h"
#include "service_fixtures.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

class ProcessTest : public DaemonTest {
 protected:
  void Start(const std::string& drain_seconds = "20") {
    DaemonTest::Start({"--drain-timeout", drain_seconds});
  }
};

TEST_F(ProcessTest, KillLosesNoAcknowledgedJobAndSpendsNoAttempt) {
  Start();
  const std::string running =
      Submit(absl::StrCat("progress 1; once ", folder() / "a", "; sleep 300; succeed mesh;"));
  std::vector<std::string> queued;
  for (int i = 0; i < 5; ++i) queued.push_back(Submit("succeed mesh;"));
  for (int round = 0; round < 3; ++round) {
    kill(pid(), SIGKILL);
    EXPECT_EQ(Wait(), -1);
    Start();
  }
  EXPECT_TRUE(Reaches(running, Job::SUCCEEDED));
  for (const std::string& name : queued) EXPECT_TRUE(Reaches(name, Job::SUCCEEDED));
}

TEST_F(ProcessTest, WorkersEndWithAKilledServer) {
  Start();
  const std::string alive = folder() / "alive";
  std::string script = "progress 1;";
  for (int i = 0; i < 2000; ++i) absl::StrAppend(&script, "sleep 50; touch ", alive, ";");
  const std::string name = Submit(script);
  ASSERT_TRUE(Eventually([&] { return ReadWholeFile(alive).ok(); }));
  kill(pid(), SIGKILL);
  Wait();
  EXPECT_TRUE(Eventually([&] {
    const std::string before = *ReadWholeFile(alive);
    absl::SleepFor(absl::Milliseconds(300));
    return *ReadWholeFile(alive) == before;
  }));
}

TEST_F(ProcessTest, TerminationFinishesRunningJobsAndExitsWithZero) {
  Start();
  const std::string name = Submit("progress 1; deaf 500; succeed mesh;");
  ASSERT_TRUE(Reaches(name, Job::RUNNING));
  kill(pid(), SIGTERM);
  EXPECT_EQ(Wait(), 0);
  Start();
  EXPECT_EQ(Get(name).state(), Job::SUCCEEDED);
}

TEST_F(ProcessTest, TerminationGivesLongJobsBack) {
  Start("0.1");
  const std::string name = Submit("progress 1; sleep 1000; succeed mesh;");
  ASSERT_TRUE(Reaches(name, Job::RUNNING));
  kill(pid(), SIGTERM);
  EXPECT_EQ(Wait(), 0);
  Start();
  EXPECT_TRUE(Reaches(name, Job::SUCCEEDED));
  EXPECT_EQ(Get(name).attempt_count(), 1);
}

TEST_F(ProcessTest, SecondSignalEndsTheDrainAtOnce) {
  Start("600");
  const std::string name = Submit("progress 1; sleep 60000;");
  ASSERT_TRUE(Reaches(name, Job::RUNNING));
  kill(pid(), SIGTERM);
  absl::SleepFor(absl::Milliseconds(200));
  kill(pid(), SIGTERM);
  EXPECT_EQ(Wait(), 0);
}

TEST_F(ProcessTest, SecondSignalAlsoEndsTheWaitForBalancersAtOnce) {
  DaemonTest::Start({"--drain-delay", "600", "--drain-timeout", "600"});
  const std::string name = Submit("progress 1; sleep 60000;");
  ASSERT_TRUE(Reaches(name, Job::RUNNING));
  kill(pid(), SIGTERM);
  absl::SleepFor(absl::Milliseconds(200));
  kill(pid(), SIGTERM);
  EXPECT_EQ(Wait(), 0);
}

TEST_F(ProcessTest, HealthTellsReadinessAndKeepsLivenessWhileDraining) {
  Start();
  HealthClient health(channel());
  EXPECT_TRUE(
      Eventually([&] { return health.Check("amhex.v1.Mesher") == HealthClient::kServing; }));
  EXPECT_EQ(health.Check(""), HealthClient::kServing);
  EXPECT_EQ(health.Check("worker"), HealthClient::kServing);
  EXPECT_EQ(health.Check("nobody"), HealthClient::kUnknown);
  const std::string name = Submit("progress 1; sleep 60000;");
  ASSERT_TRUE(Reaches(name, Job::RUNNING));
  kill(pid(), SIGTERM);
  EXPECT_TRUE(
      Eventually([&] { return health.Check("amhex.v1.Mesher") == HealthClient::kNotServing; }));
  EXPECT_EQ(health.Check(""), HealthClient::kServing);
}

TEST_F(ProcessTest, HealthWatchTellsEachServiceOfItsChangesOnly) {
  using Status = HealthClient::Status;
  Start();
  HealthWatch mesher(channel(), "amhex.v1.Mesher");
  HealthWatch blobs(channel(), "amhex.v1.Blobs");
  HealthWatch worker(channel(), "worker");
  HealthWatch process(channel(), "");
  HealthWatch nobody(channel(), "nobody");
  EXPECT_EQ(process.Next(), Status::kServing);
  EXPECT_EQ(nobody.Next(), Status::kServiceUnknown);
  EXPECT_TRUE(mesher.Reaches(Status::kServing));
  EXPECT_TRUE(worker.Reaches(Status::kServing));
  EXPECT_TRUE(blobs.Reaches(Status::kServing));
  const std::string name = Submit("progress 1; sleep 60000;");
  ASSERT_TRUE(Reaches(name, Job::RUNNING));
  kill(pid(), SIGTERM);
  EXPECT_TRUE(mesher.Reaches(Status::kNotServing));
  EXPECT_TRUE(blobs.Reaches(Status::kNotServing));
  // Whoever asks anew while it drains hears that the process lives and the worker is up.
  EXPECT_EQ(HealthWatch(channel(), "").Next(), Status::kServing);
  EXPECT_EQ(HealthWatch(channel(), "worker").Next(), Status::kServing);
  kill(pid(), SIGTERM);
  EXPECT_EQ(Wait(), 0);
  // Nothing but the end was said to those whom the drain did not concern.
  EXPECT_TRUE(process.EndsWithout(Status::kNotServing));
}

// The programs and libraries that a process has mapped.
std::string MapsOf(pid_t process) {
  std::ifstream file(absl::StrCat("/proc/", process, "/maps"));
  std::string maps;
  for (std::string line; std::getline(file, line);) absl::StrAppend(&maps, line, "\n");
  return maps;
}

TEST_F(ProcessTest, OnlyWorkersTouchTheDecoderAndTheDevice) {
#if defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the thread sanitizer does not follow the emulated device's fibers";
#endif
  setenv("AMHEX_CUDA_LIBRARY", AMHEX_EMULATED_LIBRARY, 1);
  DaemonTest::Start({"--worker", AMHEX_REAL_WORKER});
  amhex::v1::SubmitJobRequest request;
  request.set_input_encoding(amhex::v1::INPUT_ENCODING_ARRAYS);
  request.set_inline_input(CubeInput());
  request.mutable_params()->mutable_sizing()->set_cell_count(20);
  grpc::ClientContext context;
  amhex::v1::SubmitJobResponse response;
  ASSERT_TRUE(mesher().SubmitJob(&context, request, &response).ok());
  EXPECT_TRUE(Reaches(response.job().name(), Job::SUCCEEDED));
  const std::string device = std::filesystem::path(AMHEX_EMULATED_LIBRARY).filename();
  ASSERT_EQ(ChildrenOf(pid()).size(), 1u);
  const std::string of_worker = MapsOf(ChildrenOf(pid()).at(0));
  const std::string of_server = MapsOf(pid());
  ASSERT_NE(of_server.find("amhexd"), std::string::npos);
  EXPECT_NE(of_worker.find(device), std::string::npos);
  EXPECT_EQ(of_server.find(device), std::string::npos);
  EXPECT_EQ(of_server.find("libcuda"), std::string::npos);
  // The decoder's names, whether it is linked in or loaded.
  const auto names_decoder = [](const std::string& program) {
    const auto bytes = ReadWholeFile(program);
    EXPECT_TRUE(bytes.ok()) << bytes.status();
    return bytes.ok() && bytes->find("5draco") != std::string::npos;
  };
  EXPECT_TRUE(names_decoder(AMHEX_REAL_WORKER));
  EXPECT_FALSE(names_decoder(AMHEX_DAEMON));
  unsetenv("AMHEX_CUDA_LIBRARY");
}

// Runs amhexd with --check-config; gives what it printed and its exit code.
std::pair<std::string, int> CheckConfig(const std::string& flags) {
  FILE* pipe = popen((std::string(AMHEX_DAEMON) + " --check-config --worker " +
                      AMHEX_SCRIPTED_WORKER + " " + flags + " 2>&1")
                         .c_str(),
                     "r");
  std::string text;
  for (std::array<char, 256> block; fgets(block.data(), block.size(), pipe) != nullptr;) {
    text += block.data();
  }
  return {text, WEXITSTATUS(pclose(pipe))};
}

TEST_F(ProcessTest, CheckConfigPrintsWhatIsInForceAndHidesPasswords) {
  const auto [text, code] = CheckConfig("--max-attempts 7 --store postgres://me:secret@db/jobs");
  EXPECT_EQ(code, 0) << text;
  EXPECT_NE(text.find("max-attempts=7"), std::string::npos) << text;
  EXPECT_NE(text.find("listen="), std::string::npos) << text;
  EXPECT_NE(text.find("://me:***@db/jobs"), std::string::npos) << text;
  EXPECT_EQ(text.find("secret"), std::string::npos) << text;
}

TEST_F(ProcessTest, StoreIsReadFromAFileAndNotShown) {
  const std::string file = folder() / "store";
  ASSERT_TRUE(WriteFileAtomically(file, "postgres://me:secret@db/jobs\n").ok());
  const auto [text, code] = CheckConfig("--node-name 'no name' --store-file " + file);
  EXPECT_EQ(code, 2);  // only nodes of a cluster must have proper names
  EXPECT_NE(text.find("--node-name"), std::string::npos) << text;
  EXPECT_EQ(CheckConfig("--node-name name --store-file " + file).second, 0);
  EXPECT_EQ(text.find("secret"), std::string::npos) << text;
  EXPECT_EQ(CheckConfig("--store-file " + (folder() / "absent")).second, 2);
}

TEST_F(ProcessTest, CheckConfigNamesWhatIsWrong) {
  ASSERT_TRUE(WriteFileAtomically(folder() / "tokens", "nonsense").ok());
  const auto [text, code] = CheckConfig("--tokens " + (folder() / "tokens"));
  EXPECT_EQ(code, 2);
  EXPECT_NE(text.find("line 1"), std::string::npos) << text;
}

TEST_F(ProcessTest, FullDiskFailsTheJobAndNothingElse) {
  // A file system of 16 MiB of its own; where that is not permitted, no larger file than that.
  std::filesystem::create_directory(folder() / "data");
  const bool mounted = mount("tmpfs", (folder() / "data").c_str(), "tmpfs", 0, "size=16m") == 0;
  if (!mounted) {
    const rlimit limit{16 << 20, RLIM_INFINITY};
    signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  DaemonTest::Start({"--min-free-disk-bytes", "0"});
  const std::string full = Submit("large 20000000;");
  EXPECT_TRUE(Reaches(full, Job::FAILED));
  EXPECT_EQ(ReasonOf(Get(full).error()), "STORAGE_FULL") << Get(full).error().message();
  const std::string after = Submit("succeed mesh;");
  EXPECT_TRUE(Reaches(after, Job::SUCCEEDED));
  EXPECT_TRUE(std::filesystem::is_empty(folder() / "data/scratch"));
  kill(pid(), SIGTERM);
  EXPECT_EQ(Wait(), 0);
  if (mounted) umount((folder() / "data").c_str());
  const rlimit none{RLIM_INFINITY, RLIM_INFINITY};
  setrlimit(RLIMIT_FSIZE, &none);
}

TEST_F(ProcessTest, BadCommandLinesEndWithTwoAndLeaveNothing) {
  Spawn({"--listen", "0.0.0.0:0", "--data-dir", folder() / "data", "--worker",
         AMHEX_SCRIPTED_WORKER});
  EXPECT_EQ(Wait(), 2);
  Spawn({"--worker", folder() / "absent", "--data-dir", folder() / "data"});
  EXPECT_EQ(Wait(), 2);
  EXPECT_FALSE(ReadWholeFile(folder() / "data/lock").ok());
}

}  // namespace
}  // namespace amhex::server
