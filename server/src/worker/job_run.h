// Runs one job inside a worker: read, decode, mesh, write.
#pragma once

#include <functional>

#include "amhex/run_context.h"
#include "worker/worker_protocol.pb.h"

namespace amhex::server {

// Sends news to amhexd; called from the thread that runs the job.
using SendNews = std::function<void(const amhex::worker::FromWorker&)>;

// Everything that happens, failures included, is in the answer. `context` may be stopped from
// another thread at any time.
amhex::worker::Finished RunJob(const amhex::worker::RunJob& order, const SendNews& send,
                               RunContext* context);

}  // namespace amhex::server
