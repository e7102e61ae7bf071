// The part of CUDA's runtime that the engine uses, on the emulated device. Signatures and meaning
// are CUDA's; comments say only where the emulation differs.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <string>
#include <tuple>
#include <utility>

#include "emulated_cuda/emulated_device.h"
#include "support/lockstep.h"

// NOLINTBEGIN(readability-identifier-naming): CUDA's names

enum cudaError_t : int {
  cudaSuccess = amhex::emulated::kSuccess,
  cudaErrorInvalidValue = amhex::emulated::kInvalidValue,
  cudaErrorMemoryAllocation = amhex::emulated::kOutOfMemory,
  cudaErrorInvalidConfiguration = amhex::emulated::kInvalidConfiguration,
  cudaErrorNotReady = amhex::emulated::kNotReady,
  cudaErrorIllegalAddress = amhex::emulated::kIllegalAddress,
  cudaErrorStreamCaptureUnsupported = amhex::emulated::kCaptureUnsupported,
};
enum cudaMemcpyKind : int {
  cudaMemcpyHostToDevice,
  cudaMemcpyDeviceToHost,
  cudaMemcpyDeviceToDevice
};
enum cudaStreamCaptureMode : int { cudaStreamCaptureModeThreadLocal };
inline constexpr unsigned cudaStreamNonBlocking = 1;
inline constexpr unsigned cudaEventDisableTiming = 2;

enum cudaMemAllocationType : int { cudaMemAllocationTypePinned };
enum cudaMemAllocationHandleType : int { cudaMemHandleTypeNone };
enum cudaMemLocationType : int { cudaMemLocationTypeDevice };
enum cudaMemPoolAttr : int {
  cudaMemPoolAttrReleaseThreshold,
  cudaMemPoolAttrReservedMemCurrent,
  cudaMemPoolAttrUsedMemCurrent
};
struct cudaMemPoolProps {
  cudaMemAllocationType allocType;
  cudaMemAllocationHandleType handleTypes;
  struct {
    cudaMemLocationType type;
    int id;
  } location;
};

using cudaMemPool_t = amhex::emulated::Pool*;
using cudaStream_t = amhex::emulated::Stream*;
using cudaEvent_t = amhex::emulated::Event*;
using cudaGraph_t = amhex::emulated::Graph*;
using cudaGraphExec_t = amhex::emulated::Graph*;

struct dim3 {
  dim3(unsigned size_x = 1) : x(size_x) {}  // NOLINT: converts, as CUDA's does
  unsigned x, y = 1, z = 1;
};
struct cudaLaunchConfig_t {
  dim3 gridDim, blockDim;
  size_t dynamicSmemBytes;
  cudaStream_t stream;
  void* attrs;
  unsigned numAttrs;
};
struct cudaDeviceProp {
  char name[256];
  int major, minor;
  size_t totalGlobalMem;
};

namespace amhex::emulated {

// Runs `call` on the device unless the call is to fail.
template <class Call>
cudaError_t Do(const Call& call) {
  Device& device = TheDevice();
  const auto lock = device.Lock();
  if (const int code = device.Enter(); code != kSuccess) return static_cast<cudaError_t>(code);
  return static_cast<cudaError_t>(call(device));
}

// The same for what must work at any time: giving things back.
template <class Call>
cudaError_t Always(const Call& call) {
  Device& device = TheDevice();
  const auto lock = device.Lock();
  call(device);
  return cudaSuccess;
}

inline int EnqueueInto(cudaStream_t stream, Command command) {
  TheDevice().Enqueue(*stream, std::move(command));
  return kSuccess;
}

// A kernel that reads or writes the host's memory is a copy, too: a parameter tells of it.
template <class Parameter>
void CountHostBytes(const Parameter& parameter) {
  if constexpr (requires { parameter.HostBytes(); }) {
    Controls& counts = TheDevice().controls;
    ++(parameter.IsUpload() ? counts.uploads : counts.downloads);
    (parameter.IsUpload() ? counts.uploaded_bytes : counts.downloaded_bytes) +=
        parameter.HostBytes();
  }
}

template <class... Parameters>
int EnqueueKernel(const cudaLaunchConfig_t& config, void (*kernel)(Parameters...),
                  std::tuple<Parameters...> arguments) {
  constexpr unsigned kMaxThreads = 1024, kMaxBlocks = (1u << 31) - 1;
  const unsigned blocks = config.gridDim.x, threads = config.blockDim.x;
  if (blocks == 0 || blocks > kMaxBlocks || threads == 0 || threads > kMaxThreads) {
    return kInvalidConfiguration;
  }
  std::apply([](const auto&... parameters) { (CountHostBytes(parameters), ...); }, arguments);
  return EnqueueInto(config.stream, [=] {
    ++TheDevice().controls.launches;
    lockstep::Launch(blocks, static_cast<int>(threads), lockstep::Order::kDescending,
                     [&] { std::apply(kernel, arguments); });
  });
}

}  // namespace amhex::emulated

inline cudaError_t cudaDriverGetVersion(int* version) {
  *version = 13000;
  return cudaSuccess;
}
inline cudaError_t cudaRuntimeGetVersion(int* version) {
  *version = 13000;
  return cudaSuccess;
}
inline cudaError_t cudaGetDeviceCount(int* count) {
  *count = 1;
  return cudaSuccess;
}
inline cudaError_t cudaGetDevice(int* device) {
  *device = 0;
  return cudaSuccess;
}
inline cudaError_t cudaGetDeviceProperties(cudaDeviceProp* properties, int /*device*/) {
  *properties = {"emulated on the host", 9, 0,
                 static_cast<size_t>(amhex::emulated::TheDevice().controls.capacity)};
  return cudaSuccess;
}
inline cudaError_t cudaGetLastError() { return cudaSuccess; }
inline const char* cudaGetErrorString(cudaError_t code) {
  return code == cudaErrorMemoryAllocation ? "out of memory"
         : code == cudaErrorIllegalAddress ? "an illegal memory access was encountered"
                                           : "an emulated failure";
}
inline cudaError_t cudaMemGetInfo(size_t* free, size_t* total) {
  return amhex::emulated::Do([&](amhex::emulated::Device& device) {
    *free = static_cast<size_t>(std::max(
        int64_t{0}, device.controls.capacity - device.controls.used - device.controls.unused));
    *total = static_cast<size_t>(device.controls.capacity);
    return amhex::emulated::kSuccess;
  });
}

inline cudaError_t cudaDeviceGetStreamPriorityRange(int* least, int* greatest) {
  *least = 0, *greatest = -5;
  return cudaSuccess;
}
inline cudaError_t cudaStreamCreateWithPriority(cudaStream_t* stream, unsigned /*flags*/,
                                                int /*priority*/) {
  return amhex::emulated::Do([&](amhex::emulated::Device& device) {
    *stream = device.CreateStream();
    return amhex::emulated::kSuccess;
  });
}
inline cudaError_t cudaStreamDestroy(cudaStream_t stream) {
  return amhex::emulated::Always(
      [&](amhex::emulated::Device& device) { device.DestroyStream(stream); });
}
// Fails, where it does, after the work: nothing else is left when a device is lost.
inline cudaError_t cudaStreamSynchronize(cudaStream_t stream) {
  amhex::emulated::Always([&](amhex::emulated::Device& device) {
    ++device.controls.waits;
    device.Drain(*stream);
    device.ReleaseUnused();
  });
  return amhex::emulated::Do([](amhex::emulated::Device&) { return amhex::emulated::kSuccess; });
}

inline cudaError_t cudaEventCreateWithFlags(cudaEvent_t* event, unsigned /*flags*/) {
  return amhex::emulated::Do([&](amhex::emulated::Device&) {
    *event = new amhex::emulated::Event;
    return amhex::emulated::kSuccess;
  });
}
// Commands may still hold the event: it stays.
inline cudaError_t cudaEventDestroy(cudaEvent_t /*event*/) { return cudaSuccess; }
inline cudaError_t cudaEventRecord(cudaEvent_t event, cudaStream_t stream) {
  return amhex::emulated::Do([&](amhex::emulated::Device&) {
    const int64_t number = ++event->recorded;
    return amhex::emulated::EnqueueInto(stream, [=] { event->reached = number; });
  });
}
inline cudaError_t cudaEventQuery(cudaEvent_t event) {
  return amhex::emulated::Do([&](amhex::emulated::Device& device) {
    if (event->reached == event->recorded) return amhex::emulated::kSuccess;
    if (std::exchange(event->missed, event->recorded) != event->recorded) ++device.controls.looks;
    device.Advance();
    return amhex::emulated::kNotReady;
  });
}

inline cudaError_t cudaMemPoolCreate(cudaMemPool_t* pool, const cudaMemPoolProps* /*properties*/) {
  return amhex::emulated::Do([&](amhex::emulated::Device& device) {
    *pool = device.CreatePool();
    return amhex::emulated::kSuccess;
  });
}
inline cudaError_t cudaMemPoolDestroy(cudaMemPool_t pool) {
  return amhex::emulated::Always(
      [&](amhex::emulated::Device& device) { device.DestroyPool(pool); });
}
inline cudaError_t cudaMemPoolSetAttribute(cudaMemPool_t pool, cudaMemPoolAttr attribute,
                                           void* value) {
  return amhex::emulated::Do([&](amhex::emulated::Device&) {
    if (attribute != cudaMemPoolAttrReleaseThreshold) return amhex::emulated::kInvalidValue;
    pool->kept_bytes = *static_cast<const uint64_t*>(value);
    return amhex::emulated::kSuccess;
  });
}
inline cudaError_t cudaMemPoolGetAttribute(cudaMemPool_t pool, cudaMemPoolAttr attribute,
                                           void* value) {
  return amhex::emulated::Do([&](amhex::emulated::Device&) {
    int64_t bytes = pool->used;
    if (attribute == cudaMemPoolAttrReservedMemCurrent) bytes += pool->unused_bytes();
    *static_cast<uint64_t*>(value) = static_cast<uint64_t>(bytes);
    return amhex::emulated::kSuccess;
  });
}
inline cudaError_t cudaMemPoolTrimTo(cudaMemPool_t pool, size_t /*least, always zero*/) {
  return amhex::emulated::Do([&](amhex::emulated::Device& device) {
    device.Trim(*pool);
    return amhex::emulated::kSuccess;
  });
}
inline cudaError_t cudaMallocFromPoolAsync(void** memory, size_t bytes, cudaMemPool_t pool,
                                           cudaStream_t stream) {
  return amhex::emulated::Do([&](amhex::emulated::Device& device) {
    return device.Allocate(*stream, *pool, bytes, memory);
  });
}
inline cudaError_t cudaFreeAsync(void* memory, cudaStream_t stream) {
  return amhex::emulated::Always(
      [&](amhex::emulated::Device& device) { device.Free(*stream, memory); });
}
inline cudaError_t cudaMallocHost(void** memory, size_t bytes) {
  return amhex::emulated::Do([&](amhex::emulated::Device& device) {
    *memory = device.AllocatePinned(bytes);
    return amhex::emulated::kSuccess;
  });
}
inline cudaError_t cudaFreeHost(void* memory) {
  return amhex::emulated::Always(
      [&](amhex::emulated::Device& device) { device.FreePinned(memory); });
}
inline cudaError_t cudaMemcpyAsync(void* to, const void* from, size_t bytes, cudaMemcpyKind kind,
                                   cudaStream_t stream) {
  return amhex::emulated::Do([&](amhex::emulated::Device& device) {
    return device.Copy(*stream, to, from, bytes, kind == cudaMemcpyHostToDevice,
                       kind == cudaMemcpyDeviceToHost);
  });
}
inline cudaError_t cudaMemsetAsync(void* memory, int value, size_t bytes, cudaStream_t stream) {
  return amhex::emulated::Do([&](amhex::emulated::Device&) {
    return amhex::emulated::EnqueueInto(stream, [=] { std::memset(memory, value, bytes); });
  });
}

template <class... Parameters, class... Arguments>
cudaError_t cudaLaunchKernelEx(const cudaLaunchConfig_t* config, void (*kernel)(Parameters...),
                               const Arguments&... arguments) {
  return amhex::emulated::Do([&](amhex::emulated::Device&) {
    return amhex::emulated::EnqueueKernel(*config, kernel, std::tuple<Parameters...>(arguments...));
  });
}

inline cudaError_t cudaStreamBeginCapture(cudaStream_t stream, cudaStreamCaptureMode) {
  return amhex::emulated::Do([&](amhex::emulated::Device&) {
    stream->is_capturing = true;
    return amhex::emulated::kSuccess;
  });
}
inline cudaError_t cudaStreamEndCapture(cudaStream_t stream, cudaGraph_t* graph) {
  stream->is_capturing = false;
  std::vector<amhex::emulated::Command> captured = std::exchange(stream->captured, {});
  return amhex::emulated::Do([&](amhex::emulated::Device&) {
    *graph = new amhex::emulated::Graph{std::move(captured)};
    return amhex::emulated::kSuccess;
  });
}
inline cudaError_t cudaGraphInstantiate(cudaGraphExec_t* executable, cudaGraph_t graph,
                                        unsigned long long /*flags*/) {
  return amhex::emulated::Do([&](amhex::emulated::Device&) {
    *executable = new amhex::emulated::Graph(*graph);
    return amhex::emulated::kSuccess;
  });
}
inline cudaError_t cudaGraphDestroy(cudaGraph_t graph) {
  delete graph;
  return cudaSuccess;
}
inline cudaError_t cudaGraphExecDestroy(cudaGraphExec_t executable) {
  return cudaGraphDestroy(executable);
}
inline cudaError_t cudaGraphLaunch(cudaGraphExec_t executable, cudaStream_t stream) {
  return amhex::emulated::Do([&](amhex::emulated::Device& device) {
    ++device.controls.replays;
    for (const amhex::emulated::Command& command : executable->commands) {
      device.Enqueue(*stream, command);
    }
    return amhex::emulated::kSuccess;
  });
}
// NOLINTEND(readability-identifier-naming)
