#include "daemon_fixture.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <utility>

#include "files.h"
#include "process_view.h"

namespace amhex::server {

using amhex::v1::Job;

void DaemonTest::TearDown() {
  if (pid_ == 0) return;
  kill(pid_, SIGKILL);
  Wait();
}

void DaemonTest::Spawn(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), AMHEX_DAEMON);
  pid_ = StartProcess(std::move(arguments), log_path_);
  ASSERT_GT(pid_, 0);
}

void DaemonTest::Start(const std::vector<std::string>& more) {
  std::remove((folder_ / "ports").c_str());
  std::vector<std::string> arguments = {"--listen",    "127.0.0.1:0",    "--metrics-listen",
                                        "127.0.0.1:0", "--data-dir",     folder_ / "data",
                                        "--port-file", folder_ / "ports"};
  const auto add_unless_given = [&](const std::string& flag, const std::string& value) {
    for (const std::string& given : more) {
      if (given == flag) return;
    }
    arguments.push_back(flag);
    arguments.push_back(value);
  };
  add_unless_given("--worker", AMHEX_SCRIPTED_WORKER);
  add_unless_given("--log-level", "warning");
  // What the sanitizer maps for itself is more than any limit, and counts as the worker's.
  if (kQuarantineBytes > 0) add_unless_given("--worker-memory-bytes", "0");
  arguments.insert(arguments.end(), more.begin(), more.end());
  Spawn(arguments);
  ASSERT_TRUE(Eventually([&] { return !Port("grpc").empty(); }, absl::Seconds(60)));
  channel_ = grpc::CreateChannel(Port("grpc"), grpc::InsecureChannelCredentials());
  mesher_ = amhex::v1::Mesher::NewStub(channel_);
}

int DaemonTest::Wait() {
  const int code = WaitForEnd(pid_);
  pid_ = 0;
  return code;
}

std::string DaemonTest::Port(const std::string& name) {
  std::ifstream file(folder_ / "ports");
  for (std::string line; std::getline(file, line);) {
    if (line.compare(0, name.size(), name) == 0) return line.substr(name.size() + 1);
  }
  return "";
}

std::string DaemonTest::MetricsPage() {
  const std::string address = Port("metrics");
  sockaddr_in peer{};
  peer.sin_family = AF_INET;
  peer.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  peer.sin_port = htons(static_cast<uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
  const UniqueFd fd(socket(AF_INET, SOCK_STREAM, 0));
  if (connect(fd.get(), reinterpret_cast<const sockaddr*>(&peer), sizeof(peer)) != 0) return "";
  const std::string request = "GET /metrics HTTP/1.0\r\n\r\n";
  if (write(fd.get(), request.data(), request.size()) < 0) return "";
  std::string answer;
  std::array<char, 4096> block;
  for (ssize_t got; (got = read(fd.get(), block.data(), block.size())) > 0;) {
    answer.append(block.data(), static_cast<size_t>(got));
  }
  const size_t body = answer.find("\r\n\r\n");
  return body == std::string::npos ? "" : answer.substr(body + 4);
}

std::string DaemonTest::Submit(const std::string& script) {
  grpc::ClientContext context;
  amhex::v1::SubmitJobResponse response;
  const auto status = mesher_->SubmitJob(&context, ScriptRequest(script), &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.job().name();
}

Job DaemonTest::Get(const std::string& name) {
  grpc::ClientContext context;
  context.set_wait_for_ready(true);
  amhex::v1::GetJobRequest request;
  request.set_name(name);
  Job job;
  const auto status = mesher_->GetJob(&context, request, &job);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return job;
}

bool DaemonTest::Reaches(const std::string& name, Job::State state) {
  return Eventually([&] { return Get(name).state() == state; }, absl::Seconds(60));
}

}  // namespace amhex::server
