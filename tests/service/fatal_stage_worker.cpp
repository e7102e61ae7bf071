// A worker for tests: the real one, which dies, or whose server dies, when a job comes to a stage.
//
// It stands between amhexd and the real worker and passes their frames on. The folder that
// AMHEX_FATAL_STAGES names tells what happens: at the first news of stage N, the file "worker-N"
// there is removed and the worker killed with SIGKILL; with "server-N", amhexd is; with "frozen-N",
// the worker is stopped for good.
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>

#include "absl/strings/str_cat.h"
#include "worker/worker_fd.h"
#include "worker_probe.h"
#include "worker_process.h"

namespace amhex::server {
namespace {

using amhex::worker::FromWorker;
using amhex::worker::ToWorker;

constexpr absl::Duration kStartPatience = absl::Minutes(1);

class FatalStageWorker {
 public:
  FatalStageWorker(const WorkerCommand& command, std::string folder)
      : command_(command), folder_(std::move(folder)) {}

  int Run() {
    auto started = WorkerProcess::Start(command_, kStartPatience);
    if (!started.ok()) return EXIT_FAILURE;
    worker_ = *std::move(started);
    FromWorker hello;
    *hello.mutable_hello() = worker_->hello();
    if (!server_.Send(hello).ok()) return EXIT_FAILURE;
    std::thread([this] { PassOrdersOn(); }).detach();
    PassNewsOn();
    worker_->Kill();
    raise(SIGKILL);
    return EXIT_FAILURE;
  }

 private:
  void PassOrdersOn() {
    ToWorker order;
    while (server_.Receive(&order, absl::InfiniteDuration()).ok()) {
      if (order.has_run()) is_probe_ = order.run().job() == kProbeJob;
      if (!worker_->channel().Send(order).ok()) break;
    }
    worker_->Kill();
    _exit(EXIT_SUCCESS);
  }

  // Until the real worker is dead. What it still said after the fatal news died with it.
  void PassNewsOn() {
    FromWorker news;
    while (worker_->channel().Receive(&news, absl::InfiniteDuration()).ok()) {
      if (!server_.Send(news).ok()) return;
      if (!news.has_progress() || is_probe_) continue;
      const int stage = news.progress().stage();
      if (Is("server", stage)) kill(getppid(), SIGKILL);
      if (Is("worker", stage)) return;
      if (Is("frozen", stage)) Freeze();
    }
  }

  // What the worker still sent before it was stopped is not passed on.
  [[noreturn]] void Freeze() const {
    kill(worker_->pid(), SIGSTOP);
    while (true) pause();
  }

  // True once per file.
  bool Is(const std::string& victim, int stage) const {
    return unlink(absl::StrCat(folder_, "/", victim, "-", stage).c_str()) == 0;
  }

  const WorkerCommand command_;
  const std::string folder_;
  FrameChannel server_{UniqueFd(kWorkerFd)};
  std::unique_ptr<WorkerProcess> worker_;
  std::atomic<bool> is_probe_{false};
};

int Main() {
  const char* folder = std::getenv("AMHEX_FATAL_STAGES");
  return FatalStageWorker({AMHEX_REAL_WORKER, 0}, folder == nullptr ? "" : folder).Run();
}

}  // namespace
}  // namespace amhex::server

int main() { return amhex::server::Main(); }
