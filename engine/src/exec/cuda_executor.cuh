// Runs bodies on one CUDA device, ordered on one stream.
#pragma once

#include <cuda_runtime.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/iterator/transform_iterator.h>

#include <array>
#include <bit>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_reduce.cuh>
#include <cub/device/device_scan.cuh>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "base/platform.h"
#include "exec/cuda_kernels.cuh"
#include "exec/cuda_lane.cuh"
#include "exec/cuda_memory.cuh"
#include "exec/executor.h"

namespace amhex {

// One per task; used from one host thread. Every operation throws CudaError when it fails.
class CudaExecutor {
 public:
  template <class T>
  using BufferOf = DeviceBuffer<T>;

  explicit CudaExecutor(std::function<bool()> should_stop = {})
      : should_stop_(std::move(should_stop)) {}
  // Nothing may be under way that others could overtake. Tasks that end well have waited already,
  // but by asking for an event, at which a pool gives nothing back.
  ~CudaExecutor() {
    scratch_ = {};
    lane_->DropWhatWaits();
    try {
      if (is_stopped_) {
        lane_->WaitAndClearStopFlag();
      } else if (!lane_->is_idle() || lane_->pool().KeepsTooMuch()) {
        lane_->Wait();
      }
    } catch (const CudaError&) {
      CudaLane::Forget();
    }
  }
  CudaExecutor(const CudaExecutor&) = delete;
  CudaExecutor& operator=(const CudaExecutor&) = delete;

  template <class T>
  DeviceBuffer<T> Alloc(int64_t count) {
    return {count == 0 ? nullptr : Allocate(Bytes<T>(count)), count, lane_->stream()};
  }

  // Small arrays are copied when this returns, and sent together with others before anything that
  // could read them; for large ones the host waits. Nobody reads what comes after a stop, and those
  // that it was for need not live until something else is sent.
  template <class T>
  void CopyIn(const T* host, int64_t count, DeviceBuffer<T>& buffer) {
    if (count == 0 || is_stopped_) return;
    uint8_t* const staged = Stage(Bytes<T>(count));
    if (staged != nullptr) {
      std::memcpy(staged, host, Bytes<T>(count));
      lane_->SendLater(staged, Bytes<T>(count), buffer.View().data);
      return;
    }
    CheckCuda(cudaMemcpyAsync(buffer.View().data, host, Bytes<T>(count), cudaMemcpyHostToDevice,
                              lane_->BusyStream()),
              "copy to the device");
    Synchronize();
  }

  template <class T>
  void CopyOut(const DeviceBuffer<T>& buffer, int64_t count, T* host) {
    CopyOutLater(buffer, count, host);
    Synchronize();
  }

  // A copy to memory that is not pinned keeps the host until all before it is done, and the host
  // could not ask whether to stop: so large ones, which are not staged, begin when there is nothing
  // else to wait for.
  template <class T>
  void CopyOutLater(const DeviceBuffer<T>& buffer, int64_t count, T* host) {
    if (count == 0) return;
    uint8_t* const staged = Stage(Bytes<T>(count));
    if (staged != nullptr) {
      lane_->FetchLater(buffer.View().data, staged, Bytes<T>(count), host);
      return;
    }
    Synchronize();
    CheckCuda(cudaMemcpyAsync(host, buffer.View().data, Bytes<T>(count), cudaMemcpyDeviceToHost,
                              lane_->BusyStream()),
              "copy from the device");
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

  // The device writes the one number to the pinned memory itself.
  template <class Body>
  int64_t Reduce(const char* description, int64_t count, const Body& body) {
    auto* const total = reinterpret_cast<int64_t*>(Stage(sizeof(int64_t)));
    ReduceInto(description, count, body, {total, 1});
    Synchronize();
    return *total;
  }

  template <class Body>
  void ReduceInto(const char* description, int64_t count, const Body& body,
                  ArrayView<int64_t> total) {
    const auto values =
        thrust::make_transform_iterator(thrust::counting_iterator<int64_t>(0), body);
    WithScratch(description, [&](void* scratch, size_t& bytes) {
      return cub::DeviceReduce::Reduce(scratch, bytes, values, total.data, count,
                                       ::cuda::std::plus<>{}, int64_t{0}, lane_->BusyStream());
    });
  }

  void ExclusiveScan(DeviceBuffer<int32_t>& values, int64_t count) {
    if (count == 0) return;
    int32_t* data = values.View().data;
    WithScratch("scan", [&](void* scratch, size_t& bytes) {
      return cub::DeviceScan::ExclusiveSum(scratch, bytes, data, data, count, lane_->BusyStream());
    });
  }

  void SortByKey(const KeyedIds<CudaExecutor>& pairs, int64_t count, uint32_t largest_key,
                 KeyedIds<CudaExecutor>& sorted) {
    if (count == 0) return;
    const int bits = Larger(1, static_cast<int>(std::bit_width(largest_key)));
    WithScratch("sort", [&](void* scratch, size_t& bytes) {
      return cub::DeviceRadixSort::SortPairs(
          scratch, bytes, pairs.key.View().data, sorted.key.View().data, pairs.id.View().data,
          sorted.id.View().data, count, 0, bits, lane_->BusyStream());
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
      pipeline.Enqueue(1, observer, [&] { pipeline.TakeStep(step); });
    }
    CudaGraph graph;
    for (int32_t i = called; i < count && pipeline.GoesOn(); i += kStepsPerGraph) {
      if (i == called) {
        graph.Capture(lane_->BusyStream(), [&] {
          for (int s = 0; s < kStepsPerGraph; ++s) pipeline.TakeStep(step);
        });
      }
      pipeline.Enqueue(kStepsPerGraph, observer, [&] { graph.Launch(lane_->BusyStream()); });
    }
    pipeline.Finish(observer);
  }

  // Waits for everything so far, asking all the while whether to stop.
  void Synchronize() {
    try {
      WaitFor(lane_->RecordEnd());
    } catch (const CudaError&) {
      lane_->DropWhatWaits();  // others may use the lane after whoever wanted them has gone
      throw;
    }
    lane_->SetIdle(true);
  }
  bool Stopped() const { return is_stopped_; }
  const int32_t* stop_flag() const { return lane_->stop_flag(); }

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
    config.stream = lane_->BusyStream();
    CheckCuda(cudaLaunchKernelEx(&config, kernel, arguments...), description);
  }

 private:
  static constexpr int kThreadsPerBlock = 128;
  static constexpr int64_t kMaxBlocks = (int64_t{1} << 31) - 1;  // of every device, along x
  static constexpr int32_t kStepsPerGraph = 2;
  // Some 1 % of the shortest batch of iterations that is worth a device.
  static constexpr std::chrono::microseconds kWaitInterval{50};

  // Batches of steps under way, at most two, and the states after each of their steps, which the
  // device writes to pinned memory.
  class Pipeline {
   public:
    Pipeline(CudaExecutor& executor, const DeviceBuffer<int64_t>& state)
        : executor_(executor),
          state_(state),
          reports_made_(executor.Alloc<int64_t>(1)),
          reports_(executor.lane_->States(kReportsKept * state.size())) {
      CheckCuda(cudaMemsetAsync(reports_made_.View().data, 0, sizeof(int64_t),
                                executor.lane_->BusyStream()),
                "begin to report");
    }
    // The device writes to the pinned memory until it is done.
    ~Pipeline() {
      if (is_under_way_) cudaStreamSynchronize(executor_.lane_->stream());
    }
    Pipeline(const Pipeline&) = delete;
    Pipeline& operator=(const Pipeline&) = delete;

    template <class Step>
    void TakeStep(const Step& step) {
      step();
      if (state_.size() == 0) return;
      executor_.Launch("report the state", ReportStateKernel, 1, 1, state_.View(), kReportsKept,
                       reports_made_.View().data, reports_);
    }

    template <class Observer, class Launch>
    void Enqueue(int steps, const Observer& observer, const Launch& launch) {
      const int slot = next_++ % 2;
      Collect(slot, observer);
      if (!GoesOn()) return;
      is_under_way_ = true;
      launch();
      CheckCuda(cudaEventRecord(done_[slot].get(), executor_.lane_->BusyStream()),
                "record an event");
      steps_[slot] = steps;
    }

    bool GoesOn() const { return !is_enough_ && !executor_.Stopped(); }

    template <class Observer>
    void Finish(const Observer& observer) {
      for (int i = 0; i < 2; ++i) Collect(next_++ % 2, observer);
      is_under_way_ = false;
    }

   private:
    // Of two batches: those before were told of.
    static constexpr int64_t kReportsKept = 2 * kStepsPerGraph;

    // Waits for the slot's batch and tells of its steps.
    template <class Observer>
    void Collect(int slot, const Observer& observer) {
      const int steps = std::exchange(steps_[slot], 0);
      if (steps == 0) return;
      executor_.WaitFor(done_[slot]);
      for (int s = 0; s < steps; ++s) {
        const int64_t* const report = reports_ + reports_told_++ % kReportsKept * state_.size();
        if (GoesOn()) is_enough_ = HasSeenEnough(observer, report);
      }
    }

    CudaExecutor& executor_;
    const DeviceBuffer<int64_t>& state_;
    DeviceBuffer<int64_t> reports_made_;
    int64_t* reports_;  // pinned, a ring of them
    int64_t reports_told_ = 0;
    std::array<CudaEvent, 2> done_;
    std::array<int, 2> steps_{};
    int next_ = 0;
    bool is_under_way_ = false;
    bool is_enough_ = false;  // says the observer
  };

  template <class T>
  static size_t Bytes(int64_t count) {
    return static_cast<size_t>(count) * sizeof(T);
  }

  // Where the pool's free memory is in pieces, or too little with what else is left, it is given
  // back first.
  void* Allocate(size_t bytes) {
    void* data = nullptr;
    cudaError_t code = lane_->pool().Allocate(bytes, lane_->stream(), &data);
    if (code == cudaErrorMemoryAllocation) {
      cudaGetLastError();
      if (lane_->pool().Unused() > 0) {
        Synchronize();
        lane_->pool().Trim();
        code = lane_->pool().Allocate(bytes, lane_->stream(), &data);
      }
    }
    if (code == cudaSuccess) return data;
    cudaGetLastError();
    const std::string text =
        "allocate " + std::to_string(bytes) + " bytes of device memory, " + DescribeFreeMemory();
    CheckCuda(code, text.c_str());
    return nullptr;
  }

  // Null for what is too large to be staged.
  uint8_t* Stage(size_t bytes) {
    const auto wanted = static_cast<int64_t>(bytes);
    if (wanted > CudaLane::kMostStaged) return nullptr;
    uint8_t* const staged = lane_->Stage(wanted);
    if (staged != nullptr) return staged;
    Synchronize();
    return lane_->Stage(wanted);
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
    lane_->DropWhatWaits();
    lane_->SetStopFlag();
    return true;
  }

  std::shared_ptr<CudaLane> lane_ = CudaLane::OfThread();
  std::function<bool()> should_stop_;
  bool is_stopped_ = false;
  DeviceBuffer<uint8_t> scratch_;
};

static_assert(Executor<CudaExecutor>);

}  // namespace amhex
