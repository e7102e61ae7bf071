#include "cluster_fixture.h"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "files.h"
#include "leftovers.h"
#include "postgres_job_store.h"
#include "process_view.h"

namespace amhex::server {
namespace {

// For what comes in a moment, but not on a machine that has much else to do.
constexpr absl::Duration kPatience = absl::Minutes(1);

}  // namespace

Node::Node(const Options& options)
    : options_(options),
      metrics_port_(NextPort()),
      address_(options.host + ":" + std::to_string(NextPort())) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 50);
  // What connecting may take, TLS included; less than this never ends on a busy machine.
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 20'000);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 200);
  const auto channel = grpc::CreateCustomChannel(address_, options_.credentials, arguments);
  mesher_ = amhex::v1::Mesher::NewStub(channel);
  blobs_ = amhex::v1::Blobs::NewStub(channel);
  Start();
}

Node::~Node() { Kill(); }

void Node::Start() {
  const std::string ports = options_.folder + "/" + options_.name + ".ports";
  std::remove(ports.c_str());
  std::vector<std::string> words = {AMHEX_DAEMON,
                                    "--listen",
                                    address_,
                                    "--metrics-listen",
                                    options_.host + ":" + std::to_string(metrics_port_),
                                    "--data-dir",
                                    options_.folder + "/data",
                                    "--store",
                                    options_.store,
                                    "--node-name",
                                    options_.name,
                                    "--worker",
                                    AMHEX_SCRIPTED_WORKER,
                                    "--workers",
                                    std::to_string(options_.worker_count),
                                    "--lease-seconds",
                                    std::to_string(options_.lease_seconds),
                                    "--port-file",
                                    ports,
                                    "--max-attempts",
                                    "50",
                                    "--log-level",
                                    "error"};
  words.insert(words.end(), options_.flags.begin(), options_.flags.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  pid_ = fork();
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (options_.prepare) options_.prepare();
    execv(AMHEX_DAEMON, pointers.data());
    _exit(127);
  }
  ASSERT_TRUE(Eventually([&] { return std::filesystem::exists(ports); }, absl::Minutes(2)));
  ASSERT_TRUE(Eventually(
      [&] { return Metric("amhex_workers_ready") == static_cast<double>(options_.worker_count); },
      absl::Minutes(2)));
  descriptors_at_start_ = DescriptorKinds(pid_);
}

void Node::ExpectNothingLeftOver() const {
  constexpr int kMoreSockets = 12;
  EXPECT_TRUE(Eventually([&] { return Metric("amhex_watchers") == 0; }, kCleaningPatience));
  ExpectProcessAsBefore(pid_, static_cast<size_t>(options_.worker_count), descriptors_at_start_,
                        kMoreSockets);
  ExpectNothingUnfinished(options_.folder + "/data/nodes/" + options_.name);
}

void Node::Kill() {
  if (pid_ == 0) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
  pid_ = 0;
}

int Node::Terminate() {
  int status = 0;
  kill(pid_, SIGTERM);
  waitpid(pid_, &status, 0);
  pid_ = 0;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

void Node::KillWorker() const {
  const std::vector<pid_t> workers = ChildrenOf(pid_);
  if (!workers.empty()) kill(workers.front(), SIGKILL);
}

void Node::Introduce(grpc::ClientContext* context) const {
  if (!options_.token.empty()) {
    context->AddMetadata("authorization", "Bearer " + options_.token);
  }
}

double Node::Metric(const std::string& name) const {
  const int fd = ConnectToPort(options_.host, metrics_port_);
  if (fd < 0) return -1;
  const std::string request = "GET /metrics HTTP/1.0\r\n\r\n";
  send(fd, request.data(), request.size(), MSG_NOSIGNAL);
  std::string page;
  char bytes[4096];
  for (ssize_t got = 0; (got = recv(fd, bytes, sizeof(bytes), 0)) > 0;) {
    page.append(bytes, static_cast<size_t>(got));
  }
  close(fd);
  const size_t line = page.find("\n" + name + " ");
  return line == std::string::npos ? -1 : std::atof(page.c_str() + line + name.size() + 2);
}

grpc::Status Node::Submit(const amhex::v1::SubmitJobRequest& request, std::string* name) const {
  grpc::ClientContext context;
  Introduce(&context);
  context.set_deadline(absl::ToChronoTime(absl::Now() + options_.call_patience));
  amhex::v1::SubmitJobResponse response;
  const grpc::Status status = mesher_->SubmitJob(&context, request, &response);
  *name = response.job().name();
  return status;
}

grpc::Status Node::Get(const std::string& name, amhex::v1::Job* job) const {
  grpc::ClientContext context;
  Introduce(&context);
  context.set_deadline(absl::ToChronoTime(absl::Now() + options_.call_patience));
  amhex::v1::GetJobRequest request;
  request.set_name(name);
  return mesher_->GetJob(&context, request, job);
}

amhex::v1::Job::State Node::StateOf(const std::string& name) const {
  amhex::v1::Job job;
  return Get(name, &job).ok() ? job.state() : amhex::v1::Job::STATE_UNSPECIFIED;
}

std::string LongScript(const std::string& mesh) {
  std::string script;
  for (int step = 1; step <= 3000; ++step) {
    absl::StrAppend(&script, "progress ", step, "; sleep 100;");
  }
  return script + "succeed " + mesh + ";";
}

Node::Options ClusterTest::NodeOptions(int number) const {
  Node::Options options;
  options.name = "node" + std::to_string(number);
  options.store = database_;
  options.folder = folder_ / "";
  options.lease_seconds = lease_seconds_;
  options.call_patience = call_patience_;
  return options;
}

void ClusterTest::StartNodes(int count, int worker_count) {
  for (int number = 0; number < count; ++number) {
    Node::Options options = NodeOptions(number);
    options.worker_count = worker_count;
    nodes_.push_back(std::make_unique<Node>(options));
  }
}

int ClusterTest::RunnerOf(const std::string& name) {
  PostgresJobStore::Options options;
  options.url = database_;
  const auto store = *PostgresJobStore::Open(options);
  const auto address = store->RunnerAddress(name.substr(name.find('/') + 1));
  for (size_t i = 0; i < nodes_.size(); ++i) {
    if (address.ok() && nodes_[i]->address() == *address) return static_cast<int>(i);
  }
  return -1;
}

int ClusterTest::Runner(const std::string& name) {
  int runner = -1;
  EXPECT_TRUE(Eventually([&] { return (runner = RunnerOf(name)) >= 0; }, kPatience));
  return std::max(runner, 0);
}

int ClusterTest::NodeBeside(const std::string& name) {
  return (Runner(name) + 1) % static_cast<int>(nodes_.size());
}

std::string ClusterTest::Submit(int node, const std::string& script) {
  std::string name;
  const grpc::Status status = nodes_[node]->Submit(ScriptRequest(script), &name);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return name;
}

void ClusterTest::Cancel(int node, const std::string& name) {
  grpc::ClientContext context;
  nodes_[node]->Introduce(&context);
  amhex::v1::CancelJobRequest request;
  request.set_name(name);
  amhex::v1::Job job;
  EXPECT_TRUE(nodes_[node]->mesher().CancelJob(&context, request, &job).ok());
}

bool ClusterTest::Reaches(int node, const std::string& name, amhex::v1::Job::State state) {
  return Eventually([&] { return nodes_[node]->StateOf(name) == state; }, kPatience);
}

std::string ClusterTest::SubmitWaiting(int node, const std::string& mesh) {
  return Submit(node, absl::StrCat("progress 1; touch ", folder_ / ("started-" + mesh), "; await ",
                                   folder_ / "go", "; succeed ", mesh, ";"));
}

bool ClusterTest::HasStarted(const std::string& mesh) {
  return Eventually([&] { return ReadWholeFile(folder_ / ("started-" + mesh)).ok(); }, kPatience);
}

void ClusterTest::ExpectNothingLeftOver(const std::vector<amhex::v1::Job>& jobs) {
  for (const auto& node : nodes_) node->ExpectNothingLeftOver();
  ExpectBlobsOfJobsOnly(folder_ / "data/blobs", jobs);
}

void ClusterTest::LetGo() { ASSERT_TRUE(WriteFileAtomically(folder_ / "go", "go").ok()); }

}  // namespace amhex::server
