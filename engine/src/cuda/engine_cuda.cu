// What runs on a CUDA device: the engine's templates over the CUDA executor, behind the two
// functions of cuda_interface.h. The whole of libamhex_engine_cuda.so.
#include <cuda_runtime.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <exception>
#include <mutex>
#include <new>
#include <string>
#include <utility>
#include <variant>

#include "cuda/cuda_interface.h"
#include "exec/cuda_executor.cuh"
#include "exec/cuda_lane.cuh"
#include "fields/frame_smoothing_impl.h"
#include "fields/gradient_impl.h"
#include "fields/hull_nodes_impl.h"
#include "fields/lattice_impl.h"
#include "fields/ordered_total.cuh"
#include "geometry/match_impl.h"
#include "graph/nearest_search.cuh"
#include "input/hull_batch_impl.h"
#include "input/hull_tree_impl.h"
#include "input/sample_impl.h"
#include "optimize/colour_visits.cuh"
#include "optimize/sweep_impl.h"
#include "output/measure_cells_impl.h"
#include "relax/label_tiles.cuh"
#include "relax/relaxation_impl.h"
#include "topology/collect_faces_impl.h"
#include "topology/search_primitives_impl.h"

namespace amhex {
namespace {

void Write(const char* message, char* text, size_t capacity) {
  if (capacity > 0) std::snprintf(text, capacity, "%s", message);
}

// Whether there is a device. Asked before every task, so without its properties: looking them up
// takes longer than many a task.
CudaResult FindDevice(char* text, size_t capacity) {
  int driver = 0, runtime = 0, count = 0;
  CheckCuda(cudaDriverGetVersion(&driver), "ask for the driver's version");
  CheckCuda(cudaRuntimeGetVersion(&runtime), "ask for the runtime's version");
  if (driver == 0) {
    Write("no NVIDIA driver is installed", text, capacity);
    return CudaResult::kNoDevice;
  }
  const cudaError_t code = cudaGetDeviceCount(&count);
  if (code != cudaSuccess || count == 0) {
    cudaGetLastError();
    std::snprintf(text, capacity, "%s (driver for CUDA %d.%d, built with CUDA %d.%d)",
                  code == cudaSuccess ? "there is no CUDA device" : cudaGetErrorString(code),
                  driver / 1000, driver % 1000 / 10, runtime / 1000, runtime % 1000 / 10);
    return CudaResult::kNoDevice;
  }
  return CudaResult::kDone;
}

// The first device; a process that should use another one sets CUDA_VISIBLE_DEVICES.
CudaResult Describe(int64_t* memory_bytes, char* text, size_t capacity) {
  if (const CudaResult found = FindDevice(text, capacity); found != CudaResult::kDone) return found;
  cudaDeviceProp properties;
  CheckCuda(cudaGetDeviceProperties(&properties, 0), "ask for the device's properties");
  *memory_bytes = static_cast<int64_t>(properties.totalGlobalMem);
  std::snprintf(text, capacity, "cuda (%s, compute capability %d.%d, %.0f GiB)", properties.name,
                properties.major, properties.minor,
                static_cast<double>(properties.totalGlobalMem) / (1 << 30));
  return CudaResult::kDone;
}

CudaResult ResultOf(CudaFault fault) {
  switch (fault) {
    case CudaFault::kOutOfMemory:
      return CudaResult::kOutOfMemory;
    case CudaFault::kDeviceLost:
      return CudaResult::kDeviceLost;
    case CudaFault::kFailed:
      break;
  }
  return CudaResult::kFailed;
}

// Refuses before anything is copied what cannot fit.
void RequireMemory(int64_t needed, const std::string& purpose) {
  size_t free = 0, total = 0;
  CheckCuda(cudaMemGetInfo(&free, &total), "ask for the device's memory");
  const int64_t available = static_cast<int64_t>(free) + CudaLane::UnusedBytes();
  if (needed <= available) return;
  throw CudaError(purpose + " needs about " + std::to_string(needed) + " bytes of device memory, " +
                      std::to_string(available) + " of " + std::to_string(total) + " are free",
                  CudaFault::kOutOfMemory);
}

CudaResult Run(RelaxationTask& task) {
  RequireMemory(RelaxationBytes<CudaExecutor>(task) + TileLabeller<CudaExecutor>::Bytes(task) +
                    CudaExecutor::SortBytes(LargestSort(task)),
                "relaxing " + std::to_string(task.position.size()) + " sites");
  CudaExecutor executor(task.should_stop);
  const RelaxationOutcome outcome = Relaxation<CudaExecutor>(executor, task).Run();
  return outcome == RelaxationOutcome::kStopped ? CudaResult::kStopped : CudaResult::kDone;
}

CudaResult Run(fields::SmoothingTask& task) {
  const int64_t node_count = task.levels.empty() ? 0 : task.levels.back().node_count();
  RequireMemory(fields::FrameSmoothing<CudaExecutor>::Bytes(task),
                "smoothing the frames of " + std::to_string(node_count) + " nodes");
  CudaExecutor executor(task.should_stop);
  const bool is_done = fields::FrameSmoothing<CudaExecutor>(executor, task).Run();
  return is_done ? CudaResult::kDone : CudaResult::kStopped;
}

template <class Operator>
CudaResult Solve(fields::GradientTask& task) {
  using Solver = fields::GradientSolve<CudaExecutor, Operator>;
  RequireMemory(Solver::Bytes(task),
                "solving for " + std::to_string(task.unknown_count()) + " numbers of the fields");
  CudaExecutor executor(task.should_stop);
  return Solver(executor, task).Run() ? CudaResult::kDone : CudaResult::kStopped;
}

CudaResult Run(fields::GradientTask& task) {
  return std::visit([&]<class Operator>(const Operator&) { return Solve<Operator>(task); },
                    task.matrix);
}

CudaResult Run(fields::LatticeTask& task) {
  RequireMemory(
      fields::SitesOfLattice<CudaExecutor>::Bytes(task),
      "finding the sites of a lattice on " + std::to_string(task.nodes.count()) + " nodes");
  CudaExecutor executor(task.should_stop);
  return fields::SitesOfLattice<CudaExecutor>(executor, task).Run() ? CudaResult::kDone
                                                                    : CudaResult::kStopped;
}

template <class Question>
CudaResult Run(HullBatch<Question>& batch) {
  RequireMemory(
      HullBatchBytes<CudaExecutor>(batch),
      "asking the hull about " + std::to_string(batch.question.points.count()) + " points");
  CudaExecutor executor(batch.should_stop);
  return AnswerBatch(executor, batch) ? CudaResult::kDone : CudaResult::kStopped;
}

CudaResult Run(fields::HullNodesTask& task) {
  RequireMemory(fields::HullNodesBytes<CudaExecutor>(task),
                "asking the hull about " + std::to_string(task.cells.count()) + " nodes");
  CudaExecutor executor(task.should_stop);
  return fields::FindHullNodesThere(executor, task) ? CudaResult::kDone : CudaResult::kStopped;
}

CudaResult Run(HullTreeTask& task) {
  RequireMemory(HullTreeBuild<CudaExecutor>::Bytes(task),
                "building a hierarchy over " + std::to_string(task.triangles.size) + " triangles");
  ResidentSlot built;  // outlives the executor
  CudaExecutor executor(task.should_stop);
  if (!HullTreeBuild<CudaExecutor>(executor, task, built).Run()) return CudaResult::kStopped;
  *task.resident = std::move(built);
  return CudaResult::kDone;
}

// On the lane that the hierarchy was built on, of whose thread this need not be: that one waits for
// those that ask on the host, but several of them may want several hierarchies.
CudaResult Run(HullFetchTask& task) {
  static std::mutex one_at_a_time;
  const std::lock_guard<std::mutex> lock(one_at_a_time);
  task.copy = HullCopy<CudaExecutor>(*task.resident);
  return CudaResult::kDone;
}

CudaResult Run(SampleTask& task) {
  RequireMemory(HullSampling<CudaExecutor>::Bytes(task),
                "sampling the hull at " + std::to_string(task.candidate_count) + " places");
  CudaExecutor executor(task.should_stop);
  return HullSampling<CudaExecutor>(executor, task).Run() ? CudaResult::kDone
                                                          : CudaResult::kStopped;
}

CudaResult Run(SweepTask& task) {
  RequireMemory(QualitySweeps<CudaExecutor>::Bytes(task),
                "placing " + std::to_string(task.placement.vertices.size) + " vertices");
  CudaExecutor executor(task.should_stop);
  return QualitySweeps<CudaExecutor>(executor, task).Run() ? CudaResult::kDone
                                                           : CudaResult::kStopped;
}

CudaResult Run(MatchTask& task) {
  RequireMemory(
      MatchBytes<CudaExecutor>(task),
      "matching the faces of " + std::to_string(task.search.cubes.centre.size) + " cubes");
  CudaExecutor executor(task.should_stop);
  return MatchingOfCubes<CudaExecutor>(executor, task).Run() ? CudaResult::kDone
                                                             : CudaResult::kStopped;
}

CudaResult Run(MeasureCellsTask& task) {
  RequireMemory(MeasureCellsBytes<CudaExecutor>(task),
                "measuring " + std::to_string(task.cells.corners.size) + " cells");
  CudaExecutor executor(task.should_stop);
  return MeasureAll(executor, task) ? CudaResult::kDone : CudaResult::kStopped;
}

CudaResult Run(CollectFacesTask& task) {
  RequireMemory(CollectFacesBytes<CudaExecutor>(task),
                "collecting the faces of " + std::to_string(task.given.edges.size) + " edges");
  CudaExecutor executor(task.should_stop);
  return CollectAllFaces(executor, task) ? CudaResult::kDone : CudaResult::kStopped;
}

CudaResult Run(SearchPrimitivesTask& task) {
  RequireMemory(SearchPrimitivesBytes<CudaExecutor>(task),
                "searching primitives among " + std::to_string(task.complex.faces.size) + " faces");
  CudaExecutor executor(task.should_stop);
  return SearchAllTypes(executor, task) ? CudaResult::kDone : CudaResult::kStopped;
}

// Runs `step` and turns what it throws into a result and a text.
template <class Step>
CudaResult Guard(char* text, size_t capacity, const Step& step) {
  try {
    return step();
  } catch (const CudaError& error) {
    CudaLane::Forget();
    Write(error.what(), text, capacity);
    return ResultOf(error.fault());
  } catch (const std::bad_alloc&) {
    Write("not enough host memory beside the device's", text, capacity);
    return CudaResult::kOutOfMemory;
  } catch (const std::exception& error) {
    Write(error.what(), text, capacity);
    return CudaResult::kFailed;
  }
}

}  // namespace
}  // namespace amhex

extern "C" {

__attribute__((visibility("default"))) amhex::CudaResult AmhexDescribeCuda(int64_t* memory_bytes,
                                                                           char* text,
                                                                           size_t capacity) {
  return amhex::Guard(text, capacity,
                      [&] { return amhex::Describe(memory_bytes, text, capacity); });
}

__attribute__((visibility("default"))) amhex::CudaResult AmhexRunOnCuda(const amhex::CudaTask* task,
                                                                        char* text,
                                                                        size_t capacity) {
  return amhex::Guard(text, capacity, [&] {
    const amhex::CudaResult device = amhex::FindDevice(text, capacity);
    if (device != amhex::CudaResult::kDone) return device;
    return std::visit([](auto* wanted) { return amhex::Run(*wanted); }, *task);
  });
}

}  // extern "C"
