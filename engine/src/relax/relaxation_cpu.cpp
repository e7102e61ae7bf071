#include "relax/relaxation_cpu.h"

#include "exec/cpu_executor.h"
#include "relax/relaxation_impl.h"

namespace amhex {

RelaxationOutcome RelaxOnCpu(RelaxationTask& task) {
  CpuExecutor executor(task.should_stop);
  return Relaxation<CpuExecutor>(executor, task).Run();
}

}  // namespace amhex
