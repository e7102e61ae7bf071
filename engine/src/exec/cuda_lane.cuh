// What the tasks of one run share of a CUDA device.
#pragma once

#include <cuda_runtime.h>

#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

#include "exec/cuda_memory.cuh"
#include "exec/cuda_parcels.cuh"

namespace amhex {

// Streams, memory and pinned memory of the tasks that one thread runs one after the other, and of
// the copies that stay between them: making these takes longer than many a task. A lane lives as
// long as anybody holds it, so from a run's first copy that stays to the last; what the pool has
// kept is given back then.
class CudaLane {
 public:
  // This thread's lane.
  static std::shared_ptr<CudaLane> OfThread() {
    std::shared_ptr<CudaLane> lane = Latest().lock();
    if (lane == nullptr) Latest() = lane = std::make_shared<CudaLane>();
    return lane;
  }
  // Whoever asks next gets another one: this one may have been left in any state.
  static void Forget() { Latest().reset(); }
  // Bytes that this thread's lane holds of the device, for its tasks to come.
  static int64_t UnusedBytes() {
    const std::shared_ptr<CudaLane> lane = Latest().lock();
    return lane == nullptr ? 0 : lane->pool_.Unused();
  }

  CudaLane() {
    void* flag = nullptr;
    CheckCuda(pool_.Allocate(sizeof(int32_t), stream_.get(), &flag), "allocate the stop flag");
    stop_flag_ = DeviceBuffer<int32_t>(flag, 1, stream_.get());
    ClearStopFlag();
    // The stop stream is ordered after nothing: the flag must be there before it can be set.
    CheckCuda(cudaStreamSynchronize(stream_.get()), "clear the stop flag");
  }
  // Others wait for the memory.
  ~CudaLane() {
    stop_flag_ = {};
    cudaStreamSynchronize(stop_stream_.get());
    cudaStreamSynchronize(stream_.get());
  }
  CudaLane(const CudaLane&) = delete;
  CudaLane& operator=(const CudaLane&) = delete;

  CudaPool& pool() { return pool_; }
  cudaStream_t stream() const { return stream_.get(); }
  // The same for whoever sends something there that is to be waited for. What waits to be sent
  // goes first.
  cudaStream_t BusyStream() {
    is_idle_ = false;
    parcels_.Send();
    return stream_.get();
  }
  const int32_t* stop_flag() const { return stop_flag_.View().data; }

  // Kernels that are queued already leave at once.
  void SetStopFlag() {
    CheckCuda(cudaMemsetAsync(stop_flag_.View().data, 1, sizeof(int32_t), stop_stream_.get()),
              "set the stop flag");
  }
  // After a task that was stopped, for the next one: whose stop must not be overtaken by this.
  void WaitAndClearStopFlag() {
    CheckCuda(cudaStreamSynchronize(stop_stream_.get()), "set the stop flag");
    ClearStopFlag();
    Wait();
  }

  // Everything that was sent to the stream so far is done when this event is.
  const CudaEvent& RecordEnd() {
    parcels_.Send();
    CheckCuda(cudaEventRecord(end_.get(), stream_.get()), "record an event");
    return end_;
  }
  // The host has seen that it is. What was to arrive elsewhere does so, or is of no use any more.
  void SetIdle(bool delivers) {
    for (const Arrival& arrival : arrivals_) {
      if (delivers) std::memcpy(arrival.host, arrival.staged, arrival.bytes);
    }
    arrivals_.clear();
    is_idle_ = true;
    staged_ = 0;
  }
  // Staged bytes go to an array before anything else is sent to the stream.
  void SendLater(const uint8_t* staged, size_t bytes, void* array) {
    AddParcel(ParcelWay::kToDevice, staged, bytes, array);
  }
  // An array goes to staged bytes before anything else is sent to the stream, and when that has
  // been waited for to the host's memory.
  void FetchLater(const void* array, const uint8_t* staged, size_t bytes, void* host) {
    AddParcel(ParcelWay::kToHost, staged, bytes, const_cast<void*>(array));
    arrivals_.push_back({staged, bytes, host});
  }
  // Nobody is there any more who wants what has not been sent or delivered.
  void DropWhatWaits() {
    parcels_.Drop();
    arrivals_.clear();
  }
  bool is_idle() const { return is_idle_; }
  // Without asking whether to stop.
  void Wait() {
    DropWhatWaits();
    CheckCuda(cudaStreamSynchronize(stream_.get()), "wait for the device");
    SetIdle(false);
  }

  // Pinned memory for a copy of so many bytes, which is its own until the stream is waited for.
  // Null where there is too little left; after waiting there is enough for kMostStaged.
  static constexpr int64_t kMostStaged = int64_t{1} << 18;
  uint8_t* Stage(int64_t bytes) {
    if (bytes > staging_.size() - staged_) return nullptr;
    uint8_t* const place = staging_.data() + staged_;
    staged_ += (bytes + kStagedAlignment - 1) / kStagedAlignment * kStagedAlignment;
    return place;
  }
  // Pinned memory for so many numbers that report how far things are; one at a time asks for it,
  // when nobody writes to what another got.
  int64_t* States(int64_t count) {
    if (count > states_.size()) states_ = PinnedBuffer<int64_t>(count);
    return states_.data();
  }

 private:
  static constexpr int64_t kStagingBytes = int64_t{1} << 20;
  static constexpr int64_t kStagedAlignment = 64;
  static constexpr int64_t kFewestStates = 64;

  struct Arrival {
    const uint8_t* staged;
    size_t bytes;
    void* host;
  };

  static std::weak_ptr<CudaLane>& Latest() {
    thread_local std::weak_ptr<CudaLane> latest;
    return latest;
  }
  void AddParcel(ParcelWay way, const uint8_t* staged, size_t bytes, void* array) {
    is_idle_ = false;
    parcels_.Add(
        way, {static_cast<uint8_t*>(array), staged - staging_.data(), static_cast<int64_t>(bytes)});
  }
  void ClearStopFlag() {
    CheckCuda(cudaMemsetAsync(stop_flag_.View().data, 0, sizeof(int32_t), stream_.get()),
              "clear the stop flag");
  }

  CudaPool pool_;
  CudaStream stream_;
  // Overtakes what waits on the other, and the thread blocks of a kernel that have not begun.
  CudaStream stop_stream_{StreamPriority::kFirst};
  CudaEvent end_;
  PinnedBuffer<uint8_t> staging_{kStagingBytes};
  int64_t staged_ = 0;
  std::vector<Arrival> arrivals_;
  CudaParcels parcels_{stream_.get(), staging_.data()};
  PinnedBuffer<int64_t> states_{kFewestStates};
  bool is_idle_ = true;
  DeviceBuffer<int32_t> stop_flag_;
};

}  // namespace amhex
