// `amhex-worker`: a child of amhexd that decodes inputs and runs the engine, one job at a time.
//
// It finds its socket on descriptor 3 and ends when that socket closes.
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <condition_variable>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "amhex/mesher.h"
#include "convert.h"
#include "worker/frame_channel.h"
#include "worker/job_run.h"
#include "worker/worker_fd.h"
#include "worker/worker_protocol.pb.h"

namespace amhex::server {
namespace {

using amhex::worker::FromWorker;
using amhex::worker::ToWorker;

// What the thread that listens and the thread that meshes share.
struct Desk {
  std::mutex mutex;
  std::condition_variable wake;
  std::optional<amhex::worker::RunJob> order;
  std::shared_ptr<RunContext> running;
};

// Listens for orders until amhexd is gone; then ends the process, whatever it is doing. Between
// them shows that the process is not frozen: while a job runs, for an idle worker says nothing.
void Listen(FrameChannel* channel, Desk* desk) {
  while (true) {
    ToWorker frame;
    const auto outcome = channel->Receive(&frame, kSignOfLifeInterval);
    if (!outcome.ok()) _exit(EXIT_SUCCESS);
    std::lock_guard<std::mutex> lock(desk->mutex);
    if (*outcome != FrameChannel::Outcome::kFrame) {
      if (desk->running) channel->Send(FromWorker()).IgnoreError();
    } else if (frame.has_run()) {
      desk->order = frame.run();
      desk->running = std::make_shared<RunContext>();
      desk->wake.notify_one();
    } else if (frame.has_stop() && desk->running) {
      desk->running->RequestStop();
    }
  }
}

void RunOrders(FrameChannel* channel, Desk* desk) {
  // If amhexd is gone the listener ends the process.
  const SendNews send = [channel](const FromWorker& news) { channel->Send(news).IgnoreError(); };
  while (true) {
    amhex::worker::RunJob order;
    std::shared_ptr<RunContext> context;
    {
      std::unique_lock<std::mutex> lock(desk->mutex);
      desk->wake.wait(lock, [desk] { return desk->order.has_value(); });
      order = *desk->order;
      desk->order.reset();
      context = desk->running;
    }
    FromWorker news;
    *news.mutable_finished() = RunJob(order, send, context.get());
    // Whatever came of the job, a lost device is to blame: this attempt is spent, not the job.
    if (IsDeviceLost()) _exit(kDeviceLostExitCode);
    std::lock_guard<std::mutex> lock(desk->mutex);
    desk->running.reset();
    send(news);
  }
}

// Counts private writable memory, not address space: CUDA reserves far more than it uses.
bool LimitMemory(int64_t bytes) {
  if (bytes <= 0) return true;
  const rlimit limit{static_cast<rlim_t>(bytes), static_cast<rlim_t>(bytes)};
  return setrlimit(RLIMIT_DATA, &limit) == 0;
}

int RunWorker(int64_t memory_limit_bytes) {
  if (!LimitMemory(memory_limit_bytes)) {
    std::cerr << "amhex-worker: cannot set the memory limit\n";
    return EXIT_FAILURE;
  }
  // Also when it is frozen, and cannot see that its socket has closed.
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  FrameChannel channel{UniqueFd(kWorkerFd)};
  FromWorker hello;
  hello.mutable_hello()->set_engine_version(EngineVersion());
  for (const BackendInfo& backend : ListBackends()) {
    *hello.mutable_hello()->add_backends() = ToProto(backend);
  }
  if (!channel.Send(hello).ok()) {
    std::cerr << "amhex-worker: to be started by amhexd only\n";
    return EXIT_FAILURE;
  }
  Desk desk;
  std::thread listener([&channel, &desk] { Listen(&channel, &desk); });
  RunOrders(&channel, &desk);
  listener.join();
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace amhex::server

int main(int argc, char** argv) {
  CLI::App app("amhex-worker: meshes on behalf of amhexd, which starts it");
  int64_t memory_limit_bytes = 0;
  app.add_option("--memory-limit-bytes", memory_limit_bytes, "Memory it may take; 0: no bound")
      ->check(CLI::NonNegativeNumber);
  CLI11_PARSE(app, argc, argv);
  return amhex::server::RunWorker(memory_limit_bytes);
}
