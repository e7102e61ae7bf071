// The two functions that libamhex_engine_cuda.so exports. Both sides are built from one tree by one
// compiler, so C++ types may cross; exceptions may not.
#pragma once

#include <cstddef>
#include <cstdint>
#include <variant>

#include "fields/frame_smoothing.h"
#include "fields/gradient_task.h"
#include "fields/hull_nodes_task.h"
#include "fields/lattice_task.h"
#include "geometry/match_task.h"
#include "input/hull_batch.h"
#include "input/hull_tree_task.h"
#include "input/sample_task.h"
#include "input/sharp_question.h"
#include "input/width_question.h"
#include "optimize/sweep_task.h"
#include "output/measure_cells_task.h"
#include "relax/relaxation_task.h"
#include "topology/collect_faces_task.h"
#include "topology/search_primitives_task.h"

namespace amhex {

enum class CudaResult : int {
  kDone = 0,
  kStopped = 1,
  kNoDevice = 2,
  kOutOfMemory = 3,
  kFailed = 4,
  kDeviceLost = 5  // this process cannot use the device any more
};

// What the device can be asked for. A task is worked on in place, and is as it was unless it was
// done.
using CudaTask =
    std::variant<RelaxationTask*, fields::SmoothingTask*, fields::GradientTask*,
                 fields::LatticeTask*, HullBatch<SideOf<PlainPoints>>*,
                 HullBatch<SideOf<fields::CellCentres>>*, fields::HullNodesTask*,
                 HullBatch<DistanceTo<PlainPoints>>*, HullBatch<ClosestTo<PlainPoints>>*,
                 HullBatch<WindingAround<PlainPoints>>*, HullBatch<IsSharpToCells>*,
                 HullBatch<WidthAt>*, HullTreeTask*, HullFetchTask*, SampleTask*, SweepTask*,
                 MatchTask*, MeasureCellsTask*, CollectFacesTask*, SearchPrimitivesTask*>;

extern "C" {

// Writes one line about the device, or why there is none, into text[0 .. capacity), and the bytes
// of its memory.
using AmhexDescribeCudaFunction = CudaResult(int64_t* memory_bytes, char* text, size_t capacity);

// Runs `task`; on failure writes the reason.
using AmhexRunOnCudaFunction = CudaResult(const CudaTask* task, char* text, size_t capacity);

}  // extern "C"

inline constexpr char kCudaLibraryName[] = "libamhex_engine_cuda.so";
inline constexpr char kDescribeCudaSymbol[] = "AmhexDescribeCuda";
inline constexpr char kRunOnCudaSymbol[] = "AmhexRunOnCuda";

}  // namespace amhex
