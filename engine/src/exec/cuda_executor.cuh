// Runs bodies on one CUDA device, ordered on one stream of its own.
#pragma once

#include <cuda_runtime.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/iterator/transform_iterator.h>

#include <array>
#include <bit>
#include <chrono>
#include <cstdint>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_reduce.cuh>
#include <cub/device/device_scan.cuh>
#include <functional>
#include <string>
#include <thread>
#include <utility>

#include "base/platform.h"
#include "exec/cuda_memory.cuh"
#include "exec/executor.h"

namespace amhex {

// Set from the host while kernels run; read past the caches so that every block sees it.
__device__ inline bool IsStopSet(const int32_t* stop_flag) {
  return *static_cast<const volatile int32_t*>(stop_flag) != 0;
}

// One thread per element.
template <class Body>
__global__ void ForEachKernel(int64_t count, Body body, const int32_t* stop_flag) {
  const int64_t index = static_cast<int64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (index < count && !IsStopSet(stop_flag)) body(index);
}

template <class Body>
__global__ void ForEachOfKernel(ArrayView<const int64_t> count, Body body,
                                const int32_t* stop_flag) {
  const int64_t index = static_cast<int64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (index < count[0] && !IsStopSet(stop_flag)) body(index);
}

// One per run; used from one host thread. Every operation throws CudaError when it fails.
class CudaExecutor {
 public:
  template <class T>
  using BufferOf = DeviceBuffer<T>;

  explicit CudaExecutor(std::function<bool()> should_stop = {})
      : should_stop_(std::move(should_stop)), stop_flag_(1, stream_.get()) {
    CheckCuda(cudaMemsetAsync(stop_flag_.View().data, 0, sizeof(int32_t), stream_.get()),
              "clear the stop flag");
    // The stop stream is ordered after nothing: the flag must be there before it can be set.
    CheckCuda(cudaStreamSynchronize(stream_.get()), "clear the stop flag");
  }
  // Memory is freed in stream order: nothing may be under way when the owner's arrays go.
  ~CudaExecutor() {
    cudaStreamSynchronize(stop_stream_.get());
    cudaStreamSynchronize(stream_.get());
  }

  template <class T>
  DeviceBuffer<T> Alloc(int64_t count) {
    return DeviceBuffer<T>(count, stream_.get());
  }

  template <class T>
  void CopyIn(const T* host, int64_t count, DeviceBuffer<T>& buffer) {
    if (count == 0) return;
    CheckCuda(cudaMemcpyAsync(buffer.View().data, host, Bytes<T>(count), cudaMemcpyHostToDevice,
                              stream_.get()),
              "copy to the device");
    Synchronize();
  }

  // A copy to memory that is not pinned keeps the host until all before it is done, and the host
  // could not ask whether to stop: so it asks first and copies when there is nothing to wait for.
  template <class T>
  void CopyOut(const DeviceBuffer<T>& buffer, int64_t count, T* host) {
    Synchronize();
    if (count > 0) {
      CheckCuda(cudaMemcpyAsync(host, buffer.View().data, Bytes<T>(count), cudaMemcpyDeviceToHost,
                                stream_.get()),
                "copy from the device");
      CheckCuda(cudaStreamSynchronize(stream_.get()), "copy from the device");
    }
  }

  template <class Body>
  void ForEach(const char* description, int64_t count, const Body& body) {
    if (count == 0 || PollStop()) return;
    Launch(description, ForEachKernel<Body>, BlocksFor(count), kThreadsPerBlock, count, body,
           stop_flag());
  }

  template <class Body>
  void ForEachOf(const char* description, int64_t count, ArrayView<const int64_t> actual_count,
                 const Body& body) {
    if (count == 0 || PollStop()) return;
    Launch(description, ForEachOfKernel<Body>, BlocksFor(count), kThreadsPerBlock, actual_count,
           body, stop_flag());
  }

  template <class Body>
  int64_t Reduce(const char* description, int64_t count, const Body& body) {
    DeviceBuffer<int64_t> total = Alloc<int64_t>(1);
    ReduceInto(description, count, body, total.View());
    int64_t host_total = 0;
    CopyOut(total, 1, &host_total);
    return host_total;
  }

  template <class Body>
  void ReduceInto(const char* description, int64_t count, const Body& body,
                  ArrayView<int64_t> total) {
    const auto values =
        thrust::make_transform_iterator(thrust::counting_iterator<int64_t>(0), body);
    WithScratch(description, [&](void* scratch, size_t& bytes) {
      return cub::DeviceReduce::Reduce(scratch, bytes, values, total.data, count,
                                       ::cuda::std::plus<>{}, int64_t{0}, stream_.get());
    });
  }

  void ExclusiveScan(DeviceBuffer<int32_t>& values, int64_t count) {
    if (count == 0) return;
    int32_t* data = values.View().data;
    WithScratch("scan", [&](void* scratch, size_t& bytes) {
      return cub::DeviceScan::ExclusiveSum(scratch, bytes, data, data, count, stream_.get());
    });
  }

  void SortByKey(const KeyedIds<CudaExecutor>& pairs, int64_t count, uint32_t largest_key,
                 KeyedIds<CudaExecutor>& sorted) {
    if (count == 0) return;
    const int bits = Larger(1, static_cast<int>(std::bit_width(largest_key)));
    WithScratch("sort", [&](void* scratch, size_t& bytes) {
      return cub::DeviceRadixSort::SortPairs(scratch, bytes, pairs.key.View().data,
                                             sorted.key.View().data, pairs.id.View().data,
                                             sorted.id.View().data, count, 0, bits, stream_.get());
    });
  }

  // Scratch memory for sorting so many pairs: the largest that any operation here needs.
  static int64_t SortBytes(int64_t count) {
    size_t bytes = 0;
    CheckCuda(cub::DeviceRadixSort::SortPairs(nullptr, bytes, static_cast<const uint32_t*>(nullptr),
                                              static_cast<uint32_t*>(nullptr),
                                              static_cast<const int32_t*>(nullptr),
                                              static_cast<int32_t*>(nullptr), count, 0, 32),
              "ask for the sort's memory");
    return static_cast<int64_t>(bytes);
  }

  // The first two or three repetitions run as they are called, and so size all scratch memory; the
  // rest are replays of a graph of two (two, because steps may exchange double buffers). The host
  // is never more than two batches ahead and waits for nothing else.
  template <class Step, class Observer>
  void Repeat(int32_t count, const DeviceBuffer<int64_t>& state, const Step& step,
              const Observer& observer) {
    const int32_t called = count < 2 * kStepsPerGraph ? count : kStepsPerGraph + count % 2;
    Pipeline pipeline(*this, state);
    for (int32_t i = 0; i < called && pipeline.GoesOn(); ++i) {
      pipeline.Enqueue(1, observer, [&] { pipeline.TakeStep(0, step); });
    }
    CudaGraph graph;
    for (int32_t i = called; i < count && pipeline.GoesOn(); i += kStepsPerGraph) {
      if (i == called) {
        graph.Capture(stream_.get(), [&] {
          for (int s = 0; s < kStepsPerGraph; ++s) pipeline.TakeStep(s, step);
        });
      }
      pipeline.Enqueue(kStepsPerGraph, observer, [&] { graph.Launch(stream_.get()); });
    }
    pipeline.Finish(observer);
  }

  // Waits for everything so far, asking all the while whether to stop.
  void Synchronize() {
    CheckCuda(cudaEventRecord(synchronized_.get(), stream_.get()), "record an event");
    WaitFor(synchronized_);
  }
  bool Stopped() const { return is_stopped_; }
  cudaStream_t stream() const { return stream_.get(); }
  const int32_t* stop_flag() const { return stop_flag_.View().data; }

  // For kernels written by hand beside ForEach: false once the run should stop.
  bool MayLaunch() { return !PollStop(); }

  // Any number of blocks up to what a grid can have, along x.
  template <class... Parameters, class... Arguments>
  void Launch(const char* description, void (*kernel)(Parameters...), int64_t block_count,
              int thread_count, const Arguments&... arguments) {
    if (block_count > kMaxBlocks) {
      throw CudaError(std::string(description) + ": " + std::to_string(block_count) +
                          " thread blocks, limit " + std::to_string(kMaxBlocks),
                      CudaFault::kFailed);
    }
    cudaLaunchConfig_t config = {};
    config.gridDim = dim3(static_cast<unsigned>(block_count));
    config.blockDim = dim3(static_cast<unsigned>(thread_count));
    config.stream = stream_.get();
    CheckCuda(cudaLaunchKernelEx(&config, kernel, arguments...), description);
  }

 private:
  static constexpr int kThreadsPerBlock = 128;
  static constexpr int64_t kMaxBlocks = (int64_t{1} << 31) - 1;  // of every device, along x
  static constexpr int32_t kStepsPerGraph = 2;
  // Some 1 % of the shortest batch of iterations that is worth a device.
  static constexpr std::chrono::microseconds kWaitInterval{50};

  // Batches of steps under way, at most two, and the states after each of their steps.
  class Pipeline {
   public:
    Pipeline(CudaExecutor& executor, const DeviceBuffer<int64_t>& state)
        : executor_(executor),
          state_(state),
          history_(executor.Alloc<int64_t>(state.size() * kStepsPerGraph)),
          host_{PinnedBuffer<int64_t>(Larger(int64_t{1}, history_.size())),
                PinnedBuffer<int64_t>(Larger(int64_t{1}, history_.size()))} {}
    // The device writes to the pinned memory until it is done.
    ~Pipeline() { cudaStreamSynchronize(executor_.stream()); }

    template <class Step>
    void TakeStep(int place, const Step& step) {
      step();
      if (state_.size() == 0) return;
      CheckCuda(cudaMemcpyAsync(history_.View().data + place * state_.size(), state_.View().data,
                                Bytes<int64_t>(state_.size()), cudaMemcpyDeviceToDevice,
                                executor_.stream()),
                "keep the state");
    }

    template <class Observer, class Launch>
    void Enqueue(int steps, const Observer& observer, const Launch& launch) {
      const int slot = next_++ % 2;
      Collect(slot, observer);
      if (!GoesOn()) return;
      launch();
      CopyStates(host_[slot]);
      CheckCuda(cudaEventRecord(done_[slot].get(), executor_.stream()), "record an event");
      steps_[slot] = steps;
    }

    bool GoesOn() const { return !is_enough_ && !executor_.Stopped(); }

    template <class Observer>
    void Finish(const Observer& observer) {
      for (int i = 0; i < 2; ++i) Collect(next_++ % 2, observer);
    }

   private:
    void CopyStates(const PinnedBuffer<int64_t>& host) {
      if (history_.size() == 0) return;
      CheckCuda(cudaMemcpyAsync(host.data(), history_.View().data, Bytes<int64_t>(history_.size()),
                                cudaMemcpyDeviceToHost, executor_.stream()),
                "copy the states from the device");
    }

    // Waits for the slot's batch and tells of its steps.
    template <class Observer>
    void Collect(int slot, const Observer& observer) {
      const int steps = std::exchange(steps_[slot], 0);
      if (steps == 0) return;
      executor_.WaitFor(done_[slot]);
      for (int s = 0; s < steps && GoesOn(); ++s) {
        is_enough_ = HasSeenEnough(observer, host_[slot].data() + s * state_.size());
      }
    }

    CudaExecutor& executor_;
    const DeviceBuffer<int64_t>& state_;
    DeviceBuffer<int64_t> history_;
    std::array<PinnedBuffer<int64_t>, 2> host_;
    std::array<CudaEvent, 2> done_;
    std::array<int, 2> steps_{};
    int next_ = 0;
    bool is_enough_ = false;  // says the observer
  };

  template <class T>
  static size_t Bytes(int64_t count) {
    return static_cast<size_t>(count) * sizeof(T);
  }

  static int64_t BlocksFor(int64_t count) {
    return (count + kThreadsPerBlock - 1) / kThreadsPerBlock;
  }

  // Calls a CUB operation twice: for the size of its scratch memory, and to run it.
  template <class Operation>
  void WithScratch(const char* description, const Operation& operation) {
    size_t bytes = 0;
    CheckCuda(operation(nullptr, bytes), description);
    if (scratch_.size() < static_cast<int64_t>(bytes)) {
      scratch_ = {};
      scratch_ = Alloc<uint8_t>(static_cast<int64_t>(bytes));
    }
    CheckCuda(operation(scratch_.View().data, bytes), description);
  }

  // Most waits are for a copy or a short kernel: a sleep would be several times as long.
  void WaitFor(const CudaEvent& event) {
    const auto start = std::chrono::steady_clock::now();
    while (true) {
      const cudaError_t code = cudaEventQuery(event.get());
      if (code == cudaSuccess) return;
      if (code != cudaErrorNotReady) CheckCuda(code, "run on the device");
      PollStop();
      const bool is_short = std::chrono::steady_clock::now() - start < kWaitInterval;
      if (!is_short) std::this_thread::sleep_for(kWaitInterval);
    }
  }

  // Once the run should stop, kernels that are queued already leave at once.
  bool PollStop() {
    if (is_stopped_ || !should_stop_ || !should_stop_()) return is_stopped_;
    is_stopped_ = true;
    CheckCuda(cudaMemsetAsync(stop_flag_.View().data, 1, sizeof(int32_t), stop_stream_.get()),
              "set the stop flag");
    return true;
  }

  std::function<bool()> should_stop_;
  bool is_stopped_ = false;
  CudaStream stream_;
  // Overtakes what waits on the other, and the thread blocks of a kernel that have not begun.
  CudaStream stop_stream_{StreamPriority::kFirst};
  CudaEvent synchronized_;
  DeviceBuffer<int32_t> stop_flag_;
  DeviceBuffer<uint8_t> scratch_;
};

static_assert(Executor<CudaExecutor>);

}  // namespace amhex
