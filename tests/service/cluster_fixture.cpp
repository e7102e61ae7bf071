#include "cluster_fixture.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "files.h"
#include "postgres_job_store.h"

namespace amhex::server {
namespace {

constexpr int kPollMilliseconds = 20;
// For what comes in a moment, but not on a machine that has much else to do.
constexpr absl::Duration kPatience = absl::Minutes(1);

sockaddr_in SocketAddress(const std::string& host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  inet_pton(AF_INET, host.c_str(), &address.sin_addr);
  address.sin_port = htons(static_cast<uint16_t>(port));
  return address;
}

int Connect(const std::string& host, int port) {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  const sockaddr_in address = SocketAddress(host, port);
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) return fd;
  close(fd);
  return -1;
}

bool WaitReadable(int fd) {
  pollfd entry{fd, POLLIN, 0};
  return poll(&entry, 1, kPollMilliseconds) > 0;
}

std::vector<pid_t> ChildrenOf(pid_t parent) {
  std::vector<pid_t> children;
  std::error_code error;
  // Processes come and go while they are listed.
  std::filesystem::directory_iterator entry("/proc", error);
  for (; entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    // Line by line, for these calls report a process that ends while it is read in the stream's
    // state; the stream's bare buffer would throw.
    std::ifstream file(entry->path() / "stat");
    std::string text;
    for (std::string line; std::getline(file, line);) text += line;
    const size_t close = text.rfind(')');
    if (close == std::string::npos) continue;
    std::istringstream rest(text.substr(close + 1));
    char state = 0;
    pid_t found = 0;
    rest >> state >> found;
    if (found == parent) children.push_back(std::atoi(name.c_str()));
  }
  return children;
}

}  // namespace

CuttableProxy::CuttableProxy(const std::string& target_host, int target_port)
    : target_host_(target_host), target_port_(target_port) {
  listener_ = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = SocketAddress("127.0.0.1", 0);
  socklen_t size = sizeof(address);
  bind(listener_, reinterpret_cast<sockaddr*>(&address), size);
  listen(listener_, 64);
  getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
  port_ = ntohs(address.sin_port);
  threads_.emplace_back([this] { Serve(); });
}

CuttableProxy::~CuttableProxy() {
  stopping_ = true;
  threads_.front().join();
  for (size_t i = 1; i < threads_.size(); ++i) threads_[i].join();
  close(listener_);
}

void CuttableProxy::Mend() {
  // Connections of before the cut have lost their place; they break.
  ++generation_;
  cut_ = false;
}

void CuttableProxy::Serve() {
  while (!stopping_) {
    if (cut_ || !WaitReadable(listener_)) {
      if (cut_) absl::SleepFor(absl::Milliseconds(kPollMilliseconds));
      continue;
    }
    const int client = accept(listener_, nullptr, nullptr);
    const int target = Connect(target_host_, target_port_);
    if (target < 0) {
      close(client);
      continue;
    }
    const int64_t generation = generation_;
    threads_.emplace_back([this, client, target, generation] {
      std::thread back([=, this] { Pass(target, client, generation); });
      Pass(client, target, generation);
      back.join();
      close(client);
      close(target);
    });
  }
}

void CuttableProxy::Pass(int from, int to, int64_t generation) {
  char bytes[65536];
  while (!stopping_ && generation == generation_) {
    if (cut_) {
      absl::SleepFor(absl::Milliseconds(kPollMilliseconds));
      continue;
    }
    if (!WaitReadable(from)) continue;
    const ssize_t got = recv(from, bytes, sizeof(bytes), 0);
    if (got <= 0 || send(to, bytes, static_cast<size_t>(got), MSG_NOSIGNAL) != got) break;
  }
  shutdown(from, SHUT_RDWR);
  shutdown(to, SHUT_RDWR);
}

Node::Node(const Options& options)
    : options_(options),
      metrics_port_(NextPort()),
      address_(options.host + ":" + std::to_string(NextPort())) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 50);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 50);
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
  const int fd = Connect(options_.host, metrics_port_);
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

void ClusterTest::LetGo() { ASSERT_TRUE(WriteFileAtomically(folder_ / "go", "go").ok()); }

}  // namespace amhex::server
