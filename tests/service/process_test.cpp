// The real amhexd as a process: signals, kill -9, exit codes, health. Workers follow scripts.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <array>
#include <filesystem>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "amhex/v1/meshing_service.grpc.pb.h"
#include "errors.h"
#include "files.h"
#include "health_client.h"
#include "job.h"
#include "service_fixtures.h"

extern char** environ;

namespace amhex::server {
namespace {

using amhex::v1::Job;

class ProcessTest : public ::testing::Test {
 protected:
  void TearDown() override {
    if (pid_ != 0) {
      kill(pid_, SIGKILL);
      Wait();
    }
  }

  void Spawn(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), AMHEX_DAEMON);
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    ASSERT_EQ(posix_spawn(&pid_, AMHEX_DAEMON, nullptr, nullptr, pointers.data(), environ), 0);
  }

  void Start(const std::string& drain_seconds = "20") {
    std::remove((folder_ / "ports").c_str());
    Spawn({"--listen", "127.0.0.1:0", "--metrics-listen", "127.0.0.1:0", "--data-dir",
           folder_ / "data", "--worker", AMHEX_SCRIPTED_WORKER, "--port-file", folder_ / "ports",
           "--drain-timeout", drain_seconds, "--log-level", "warning"});
    ASSERT_TRUE(Eventually([&] { return !Port("grpc").empty(); }));
    channel_ = grpc::CreateChannel(Port("grpc"), grpc::InsecureChannelCredentials());
    mesher_ = amhex::v1::Mesher::NewStub(channel_);
  }

  // The address after "name=" in the port file.
  std::string Port(const std::string& name) {
    std::ifstream file(folder_ / "ports");
    for (std::string line; std::getline(file, line);) {
      if (line.compare(0, name.size(), name) == 0) return line.substr(name.size() + 1);
    }
    return "";
  }

  // The exit code, or -1 after death by a signal.
  int Wait() {
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  std::string Submit(const std::string& script) {
    grpc::ClientContext context;
    amhex::v1::SubmitJobResponse response;
    const auto status = mesher_->SubmitJob(&context, ScriptRequest(script), &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.job().name();
  }

  Job Get(const std::string& name) {
    grpc::ClientContext context;
    context.set_wait_for_ready(true);
    amhex::v1::GetJobRequest request;
    request.set_name(name);
    Job job;
    const auto status = mesher_->GetJob(&context, request, &job);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return job;
  }

  bool Reaches(const std::string& name, Job::State state) {
    return Eventually([&] { return Get(name).state() == state; });
  }

  TemporaryFolder folder_;
  pid_t pid_ = 0;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<amhex::v1::Mesher::Stub> mesher_;
};

TEST_F(ProcessTest, KillLosesNoAcknowledgedJobAndSpendsNoAttempt) {
  Start();
  const std::string running =
      Submit(absl::StrCat("progress 1; once ", folder_ / "a", "; sleep 300; succeed mesh;"));
  std::vector<std::string> queued;
  for (int i = 0; i < 5; ++i) queued.push_back(Submit("succeed mesh;"));
  for (int round = 0; round < 3; ++round) {
    kill(pid_, SIGKILL);
    EXPECT_EQ(Wait(), -1);
    Start();
  }
  EXPECT_TRUE(Reaches(running, Job::SUCCEEDED));
  for (const std::string& name : queued) EXPECT_TRUE(Reaches(name, Job::SUCCEEDED));
}

TEST_F(ProcessTest, WorkersEndWithAKilledServer) {
  Start();
  const std::string alive = folder_ / "alive";
  std::string script = "progress 1;";
  for (int i = 0; i < 200; ++i) absl::StrAppend(&script, "sleep 50; touch ", alive, ";");
  const std::string name = Submit(script);
  ASSERT_TRUE(Eventually([&] { return ReadWholeFile(alive).ok(); }));
  kill(pid_, SIGKILL);
  Wait();
  absl::SleepFor(absl::Milliseconds(300));
  const std::string before = *ReadWholeFile(alive);
  absl::SleepFor(absl::Milliseconds(300));
  EXPECT_EQ(*ReadWholeFile(alive), before);
}

TEST_F(ProcessTest, TerminationFinishesRunningJobsAndExitsWithZero) {
  Start();
  const std::string name = Submit("progress 1; deaf 500; succeed mesh;");
  ASSERT_TRUE(Reaches(name, Job::RUNNING));
  kill(pid_, SIGTERM);
  EXPECT_EQ(Wait(), 0);
  Start();
  EXPECT_EQ(Get(name).state(), Job::SUCCEEDED);
}

TEST_F(ProcessTest, TerminationGivesLongJobsBack) {
  Start("0.1");
  const std::string name = Submit("progress 1; sleep 1000; succeed mesh;");
  ASSERT_TRUE(Reaches(name, Job::RUNNING));
  kill(pid_, SIGTERM);
  EXPECT_EQ(Wait(), 0);
  Start();
  EXPECT_TRUE(Reaches(name, Job::SUCCEEDED));
  EXPECT_EQ(Get(name).attempt_count(), 1);
}

TEST_F(ProcessTest, SecondSignalEndsTheDrainAtOnce) {
  Start("600");
  const std::string name = Submit("progress 1; sleep 60000;");
  ASSERT_TRUE(Reaches(name, Job::RUNNING));
  kill(pid_, SIGTERM);
  absl::SleepFor(absl::Milliseconds(200));
  kill(pid_, SIGTERM);
  EXPECT_EQ(Wait(), 0);
}

TEST_F(ProcessTest, HealthTellsReadinessAndKeepsLivenessWhileDraining) {
  Start();
  HealthClient health(channel_);
  EXPECT_TRUE(
      Eventually([&] { return health.Check("amhex.v1.Mesher") == HealthClient::kServing; }));
  EXPECT_EQ(health.Check(""), HealthClient::kServing);
  EXPECT_EQ(health.Check("worker"), HealthClient::kServing);
  EXPECT_EQ(health.Check("nobody"), HealthClient::kUnknown);
  const std::string name = Submit("progress 1; sleep 60000;");
  ASSERT_TRUE(Reaches(name, Job::RUNNING));
  kill(pid_, SIGTERM);
  EXPECT_TRUE(
      Eventually([&] { return health.Check("amhex.v1.Mesher") == HealthClient::kNotServing; }));
  EXPECT_EQ(health.Check(""), HealthClient::kServing);
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

TEST_F(ProcessTest, CheckConfigNamesWhatIsWrong) {
  ASSERT_TRUE(WriteFileAtomically(folder_ / "tokens", "nonsense").ok());
  const auto [text, code] = CheckConfig("--tokens " + (folder_ / "tokens"));
  EXPECT_EQ(code, 2);
  EXPECT_NE(text.find("line 1"), std::string::npos) << text;
}

TEST_F(ProcessTest, FullDiskFailsTheJobAndNothingElse) {
  // A file system of 16 MiB of its own; where that is not permitted, no larger file than that.
  std::filesystem::create_directory(folder_ / "data");
  const bool mounted = mount("tmpfs", (folder_ / "data").c_str(), "tmpfs", 0, "size=16m") == 0;
  if (!mounted) {
    const rlimit limit{16 << 20, RLIM_INFINITY};
    signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  Start();
  const std::string full = Submit("large 20000000;");
  EXPECT_TRUE(Reaches(full, Job::FAILED));
  EXPECT_EQ(ReasonOf(Get(full).error()), "STORAGE_FULL") << Get(full).error().message();
  const std::string after = Submit("succeed mesh;");
  EXPECT_TRUE(Reaches(after, Job::SUCCEEDED));
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "data/scratch"));
  kill(pid_, SIGTERM);
  EXPECT_EQ(Wait(), 0);
  if (mounted) umount((folder_ / "data").c_str());
  const rlimit none{RLIM_INFINITY, RLIM_INFINITY};
  setrlimit(RLIMIT_FSIZE, &none);
}

TEST_F(ProcessTest, BadCommandLinesEndWithTwoAndLeaveNothing) {
  Spawn(
      {"--listen", "0.0.0.0:0", "--data-dir", folder_ / "data", "--worker", AMHEX_SCRIPTED_WORKER});
  EXPECT_EQ(Wait(), 2);
  Spawn({"--worker", folder_ / "absent", "--data-dir", folder_ / "data"});
  EXPECT_EQ(Wait(), 2);
  EXPECT_FALSE(ReadWholeFile(folder_ / "data/lock").ok());
}

}  // namespace
}  // namespace amhex::server
