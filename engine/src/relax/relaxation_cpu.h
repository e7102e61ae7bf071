// The relaxation on the threads of the current oneTBB arena.
#pragma once

#include "relax/relaxation_task.h"

namespace amhex {

// Runs `task` in place. Same task, same bits, at any number of threads.
RelaxationOutcome RelaxOnCpu(RelaxationTask& task);

}  // namespace amhex
