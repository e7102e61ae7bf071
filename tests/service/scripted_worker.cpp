// A worker for tests: speaks amhexd's frame protocol, but does what its input says instead of
// meshing. The script follows the 32 bytes of an AMHEXHUL header; its commands end with ';'.
//
//   decode            reports that decoding has begun
//   progress N        reports iteration N of the relaxation
//   stage             reports that the relaxation is done
//   sleep MS          waits; a stop order ends the job as cancelled
//   await PATH        waits until the file PATH exists, like sleep
//   deaf MS           waits and ignores stop orders
//   abort | kill      dies by SIGABRT or SIGKILL
//   once PATH         goes on only if the file PATH exists; else makes it and dies by SIGKILL
//   touch PATH        appends a line to the file PATH
//   at STAGE          reports that the stage of this number has begun
//   until PATH        waits, like sleep, until the file PATH exists
//   fail              ends the job with an error
//   large BYTES       writes so many bytes as the result; ends the job as the worker does then
//   hollow BYTES      the same with zeros that take no room on disk
//   succeed TEXT      writes TEXT as the result and ends the job
#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>

#include "errors.h"
#include "files.h"
#include "input_preflight.h"
#include "worker/frame_channel.h"
#include "worker/worker_fd.h"
#include "worker/worker_protocol.pb.h"
#include "worker_probe.h"

namespace amhex::server {
namespace {

using amhex::worker::FromWorker;
using amhex::worker::ToWorker;

class ScriptedWorker {
 public:
  int Run() {
    FromWorker hello;
    hello.mutable_hello()->set_engine_version("scripted");
    auto* backend = hello.mutable_hello()->add_backends();
    backend->set_backend(amhex::v1::BACKEND_CPU);
    backend->set_available(true);
    if (!channel_.Send(hello).ok()) return EXIT_FAILURE;
    std::thread([this] { ShowLife(); }).detach();
    while (true) {
      ToWorker frame;
      const auto outcome = channel_.Receive(&frame, absl::InfiniteDuration());
      if (!outcome.ok()) return EXIT_SUCCESS;
      if (frame.has_run()) Perform(frame.run());
    }
  }

 private:
  // As the real worker does while it has a job.
  void ShowLife() {
    while (true) {
      std::this_thread::sleep_for(absl::ToChronoMilliseconds(kSignOfLifeInterval));
      std::lock_guard<std::mutex> lock(verdict_mutex_);
      if (!finished_) Send(FromWorker());
    }
  }

  void Perform(const amhex::worker::RunJob& order) {
    order_ = order;
    finished_ = false;
    if (order.job() == kProbeJob) return Probe();
    const auto bytes = ReadWholeFile(order.input_path());
    std::istringstream script(bytes.ok() ? bytes->substr(kArraysHeaderBytes) : "");
    std::string command;
    while (!finished_ && std::getline(script, command, ';')) {
      std::istringstream words(command);
      std::string verb;
      std::string argument;
      words >> verb >> argument;
      Obey(verb, argument);
    }
    if (!finished_) Fail("the script ended without a verdict");
  }

  // The trial job: dies while the file that AMHEX_SCRIPTED_FAULT names is there.
  void Probe() {
    const char* fault = std::getenv("AMHEX_SCRIPTED_FAULT");
    if (fault != nullptr && access(fault, F_OK) == 0) raise(SIGABRT);
    Succeed("probe");
  }

  void Obey(const std::string& verb, const std::string& argument) {
    if (verb == "decode") Progress(amhex::v1::STAGE_DECODE_INPUT, 0);
    if (verb == "progress") Progress(amhex::v1::STAGE_RELAX, std::stoi(argument));
    if (verb == "stage") Stage();
    if (verb == "sleep") Sleep(std::stoi(argument));
    while (verb == "await" && !finished_ && access(argument.c_str(), F_OK) != 0) Sleep(20);
    if (verb == "deaf") std::this_thread::sleep_for(std::chrono::milliseconds(std::stoi(argument)));
    if (verb == "abort") raise(SIGABRT);
    if (verb == "kill") raise(SIGKILL);
    if (verb == "once") Once(argument);
    if (verb == "at") Progress(static_cast<amhex::v1::Stage>(std::stoi(argument)), 0);
    if (verb == "until") Until(argument);
    if (verb == "touch") std::ofstream(argument, std::ios::app) << "here\n";
    if (verb == "fail") Fail("as the script says");
    if (verb == "large") Large(std::stoul(argument));
    if (verb == "hollow") Hollow(std::stol(argument));
    if (verb == "succeed") Succeed(argument);
  }

  void Progress(amhex::v1::Stage stage, int iteration) {
    FromWorker news;
    news.mutable_progress()->set_stage(stage);
    news.mutable_progress()->set_iteration(iteration);
    Send(news);
  }

  void Stage() {
    FromWorker news;
    news.mutable_stage()->set_stage(amhex::v1::STAGE_RELAX);
    news.mutable_stage()->mutable_wall_duration()->set_nanos(1'000'000);
    Send(news);
  }

  void Sleep(int milliseconds) {
    ToWorker frame;
    const auto outcome = channel_.Receive(&frame, absl::Milliseconds(milliseconds));
    if (!outcome.ok()) _exit(EXIT_SUCCESS);
    if (*outcome == FrameChannel::Outcome::kFrame && frame.has_stop()) {
      Finish(absl::CancelledError("stopped"));
    }
  }

  void Until(const std::string& path) {
    while (!finished_ && access(path.c_str(), F_OK) != 0) Sleep(20);
  }

  void Once(const std::string& path) {
    if (access(path.c_str(), F_OK) == 0) return;
    std::ofstream file(path);
    file.close();
    raise(SIGKILL);
  }

  void Fail(const std::string& message) {
    Finish(MakeError(absl::StatusCode::kInvalidArgument, amhex::v1::INPUT_INVALID, message));
  }

  void Finish(const absl::Status& error) {
    FromWorker news;
    *news.mutable_finished()->mutable_error() = ToRpcStatus(error);
    SendVerdict(news);
  }

  void Succeed(const std::string& text) {
    FromWorker news;
    if (order_.estimate_only()) {
      news.mutable_finished()->mutable_estimate()->set_cell_count(42);
    } else {
      std::ofstream(order_.output_path()) << text;
      news.mutable_finished()->mutable_result()->set_encoding(amhex::v1::MESH_ENCODING_ARRAYS);
    }
    SendVerdict(news);
  }

  void Large(size_t size) {
    auto fd = OpenFile(order_.output_path(), O_WRONLY | O_CREAT);
    const std::string bytes(size, 'x');
    if (!fd.ok()) return Finish(fd.status());
    const absl::Status status = WriteAllAt(fd->get(), bytes.data(), bytes.size(), 0);
    FinishFile(*std::move(fd), status);
  }

  void Hollow(int64_t size) {
    auto fd = OpenFile(order_.output_path(), O_WRONLY | O_CREAT);
    if (!fd.ok()) return Finish(fd.status());
    const bool is_extended = ftruncate(fd->get(), size) == 0;
    FinishFile(*std::move(fd), is_extended ? absl::OkStatus() : FileError("cannot extend", errno));
  }

  // The file is closed first: a full disk has its room back once the server has removed it.
  void FinishFile(UniqueFd fd, const absl::Status& status) {
    fd.Reset();
    if (!status.ok()) return Finish(status);
    FromWorker news;
    news.mutable_finished()->mutable_result()->set_encoding(amhex::v1::MESH_ENCODING_ARRAYS);
    SendVerdict(news);
  }

  // Nothing comes after it.
  void SendVerdict(const FromWorker& news) {
    std::lock_guard<std::mutex> lock(verdict_mutex_);
    finished_ = true;
    Send(news);
  }

  void Send(const FromWorker& news) {
    if (!channel_.Send(news).ok()) _exit(EXIT_SUCCESS);
  }

  FrameChannel channel_{UniqueFd(kWorkerFd)};
  amhex::worker::RunJob order_;
  std::mutex verdict_mutex_;
  std::atomic<bool> finished_{true};
};

}  // namespace
}  // namespace amhex::server

int main() { return amhex::server::ScriptedWorker().Run(); }
