// Streams, events and memory of one CUDA device, each ending with its owner.
#pragma once

#include <cuda_runtime.h>

#include <cstdint>
#include <string>
#include <utility>

#include "base/array_view.h"
#include "exec/cuda_error.h"

namespace amhex {

// After an error that the device does not survive every further call fails with it. The question
// for free memory waits for nobody's work and may be asked while a graph is being recorded.
inline CudaFault FaultOf(cudaError_t code) {
  cudaGetLastError();
  size_t free = 0, total = 0;
  const bool is_lost = cudaMemGetInfo(&free, &total) != cudaSuccess;
  cudaGetLastError();
  if (is_lost) return CudaFault::kDeviceLost;
  return code == cudaErrorMemoryAllocation ? CudaFault::kOutOfMemory : CudaFault::kFailed;
}

// Throws CudaError naming the step. An error that the device survives, such as a failed
// allocation, is cleared.
inline void CheckCuda(cudaError_t code, const char* description) {
  if (code == cudaSuccess) return;
  throw CudaError(std::string(description) + ": " + cudaGetErrorString(code), FaultOf(code));
}

// What the device has left; for messages, so a failure to ask is no failure.
inline std::string DescribeFreeMemory() {
  size_t free = 0, total = 0;
  if (cudaMemGetInfo(&free, &total) != cudaSuccess) {
    cudaGetLastError();
    return "free memory unknown";
  }
  return std::to_string(free) + " of " + std::to_string(total) + " bytes are free";
}

// Whose thread blocks have their turn when one of the device's places falls free. Of streams that
// are alike it is those of the kernel that was first, to its last block.
enum class StreamPriority { kUsual, kFirst };

class CudaStream {
 public:
  explicit CudaStream(StreamPriority priority = StreamPriority::kUsual) {
    int usual = 0, first = 0;
    CheckCuda(cudaDeviceGetStreamPriorityRange(&usual, &first), "ask for streams' priorities");
    CheckCuda(cudaStreamCreateWithPriority(&stream_, cudaStreamNonBlocking,
                                           priority == StreamPriority::kFirst ? first : usual),
              "create a stream");
  }
  ~CudaStream() { cudaStreamDestroy(stream_); }
  CudaStream(const CudaStream&) = delete;
  CudaStream& operator=(const CudaStream&) = delete;
  cudaStream_t get() const { return stream_; }

 private:
  cudaStream_t stream_ = nullptr;
};

class CudaEvent {
 public:
  CudaEvent() {
    CheckCuda(cudaEventCreateWithFlags(&event_, cudaEventDisableTiming), "create an event");
  }
  ~CudaEvent() { cudaEventDestroy(event_); }
  CudaEvent(const CudaEvent&) = delete;
  CudaEvent& operator=(const CudaEvent&) = delete;
  cudaEvent_t get() const { return event_; }

 private:
  cudaEvent_t event_ = nullptr;
};

// A recorded sequence of launches that replays as one.
class CudaGraph {
 public:
  CudaGraph() = default;
  ~CudaGraph() {
    if (executable_ != nullptr) cudaGraphExecDestroy(executable_);
  }
  CudaGraph(const CudaGraph&) = delete;
  CudaGraph& operator=(const CudaGraph&) = delete;

  // Records what `enqueue` sends to the stream, without running it.
  template <class Enqueue>
  void Capture(cudaStream_t stream, const Enqueue& enqueue) {
    CheckCuda(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal), "begin a graph");
    cudaGraph_t graph = nullptr;
    try {
      enqueue();
    } catch (...) {
      if (cudaStreamEndCapture(stream, &graph) == cudaSuccess) cudaGraphDestroy(graph);
      cudaGetLastError();
      throw;
    }
    CheckCuda(cudaStreamEndCapture(stream, &graph), "end a graph");
    const cudaError_t code = cudaGraphInstantiate(&executable_, graph, 0);
    cudaGraphDestroy(graph);
    CheckCuda(code, "instantiate a graph");
  }

  void Launch(cudaStream_t stream) {
    CheckCuda(cudaGraphLaunch(executable_, stream), "launch a graph");
  }

 private:
  cudaGraphExec_t executable_ = nullptr;
};

// Device memory of one owner, allocated and freed in stream order.
class CudaPool {
 public:
  CudaPool() {
    cudaMemPoolProps properties = {};
    properties.allocType = cudaMemAllocationTypePinned;
    properties.handleTypes = cudaMemHandleTypeNone;
    properties.location.type = cudaMemLocationTypeDevice;
    CheckCuda(cudaGetDevice(&properties.location.id), "ask for the device");
    CheckCuda(cudaMemPoolCreate(&pool_, &properties), "create a memory pool");
    size_t free = 0, total = 0;
    if (cudaMemGetInfo(&free, &total) != cudaSuccess) cudaGetLastError();
    kept_ = static_cast<int64_t>(total / kKeptShare);
    SetAttribute(cudaMemPoolAttrReleaseThreshold, static_cast<uint64_t>(kept_));
  }
  // What is still on its way back to the pool gets there first.
  ~CudaPool() { cudaMemPoolDestroy(pool_); }
  CudaPool(const CudaPool&) = delete;
  CudaPool& operator=(const CudaPool&) = delete;

  cudaError_t Allocate(size_t bytes, cudaStream_t stream, void** data) {
    return cudaMallocFromPoolAsync(data, bytes, pool_, stream);
  }
  // Bytes that the pool holds and nobody uses.
  int64_t Unused() const { return Held() - Attribute(cudaMemPoolAttrUsedMemCurrent); }
  // Whether some would go back to the device if its stream were waited for. An event that is asked
  // for is no wait to a pool.
  bool KeepsTooMuch() const { return Held() > kept_ && Unused() > 0; }
  // Gives them back to the device.
  void Trim() { CheckCuda(cudaMemPoolTrimTo(pool_, 0), "give memory back"); }

 private:
  // Of the device's memory a pool keeps at most this part when it is waited for: mapping memory
  // anew takes longer than many a task, but other processes want some, too.
  static constexpr size_t kKeptShare = 8;

  void SetAttribute(cudaMemPoolAttr attribute, uint64_t value) {
    const cudaError_t code = cudaMemPoolSetAttribute(pool_, attribute, &value);
    if (code == cudaSuccess) return;
    cudaMemPoolDestroy(pool_);
    CheckCuda(code, "set up a memory pool");
  }
  int64_t Held() const { return Attribute(cudaMemPoolAttrReservedMemCurrent); }
  int64_t Attribute(cudaMemPoolAttr attribute) const {
    uint64_t value = 0;
    CheckCuda(cudaMemPoolGetAttribute(pool_, attribute, &value), "ask a memory pool");
    return static_cast<int64_t>(value);
  }

  cudaMemPool_t pool_ = nullptr;
  int64_t kept_ = 0;
};

// An array in device memory, freed in stream order. Elements start undefined.
template <class T>
class DeviceBuffer {
 public:
  DeviceBuffer() = default;
  // Takes over memory that `stream` has allocated; null if there are no elements.
  DeviceBuffer(void* data, int64_t size, cudaStream_t stream)
      : data_(static_cast<T*>(data)), size_(size), stream_(stream) {}
  ~DeviceBuffer() {
    if (data_ != nullptr) cudaFreeAsync(data_, stream_);
  }
  DeviceBuffer(DeviceBuffer&& other) noexcept { Swap(other); }
  DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
    Swap(other);
    return *this;
  }

  ArrayView<T> View() { return {data_, size_}; }
  ArrayView<const T> View() const { return {data_, size_}; }
  int64_t size() const { return size_; }

 private:
  void Swap(DeviceBuffer& other) {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(stream_, other.stream_);
  }

  T* data_ = nullptr;
  int64_t size_ = 0;
  cudaStream_t stream_ = nullptr;
};

// An array in host memory that the device copies from or to while the host goes on.
template <class T>
class PinnedBuffer {
 public:
  explicit PinnedBuffer(int64_t size) : size_(size) {
    CheckCuda(
        cudaMallocHost(reinterpret_cast<void**>(&data_), static_cast<size_t>(size) * sizeof(T)),
        "allocate pinned host memory");
  }
  ~PinnedBuffer() {
    if (data_ != nullptr) cudaFreeHost(data_);
  }
  PinnedBuffer(PinnedBuffer&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  PinnedBuffer& operator=(PinnedBuffer&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  T* data() const { return data_; }
  int64_t size() const { return size_; }

 private:
  T* data_ = nullptr;
  int64_t size_ = 0;
};

}  // namespace amhex
