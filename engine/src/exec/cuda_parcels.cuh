// Small arrays on their way between the host and a device: many of them at once.
#pragma once

#include <cuda_runtime.h>

#include <cstdint>

#include "exec/cuda_memory.cuh"

namespace amhex {

// A whole array of the device, and its place in pinned memory that holds many. Both are aligned to
// words.
struct Parcel {
  uint8_t* array = nullptr;
  int64_t place = 0;
  int64_t bytes = 0;
};
enum class ParcelWay { kToDevice, kToHost };

// What a device reads or writes at once.
struct alignas(16) ParcelWord {
  uint64_t low, high;
};

// As many as go into a kernel's parameters, of which there are 4 kB.
struct ParcelList {
  static constexpr int kMost = 128;
  ParcelWay way = ParcelWay::kToDevice;
  Parcel parcels[kMost];
  int count = 0;

  // What goes over the bus.
  int64_t HostBytes() const {
    int64_t sum = 0;
    for (int i = 0; i < count; ++i) sum += parcels[i].bytes;
    return sum;
  }
  bool IsUpload() const { return way == ParcelWay::kToDevice; }
};

// Reads or writes the pinned memory itself: one trip for all parcels, without a second copy on the
// device. One thread per word of the places from `begin` on.
static __global__ void MoveParcelsKernel(uint8_t* pinned, int64_t begin, int64_t word_count,
                                         ParcelList list) {
  constexpr int64_t kWord = sizeof(ParcelWord);
  const int64_t word = static_cast<int64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (word >= word_count) return;
  const int64_t place = begin + word * kWord;
  for (int i = 0; i < list.count; ++i) {
    const Parcel& parcel = list.parcels[i];
    const int64_t offset = place - parcel.place;
    if (offset < 0 || offset >= parcel.bytes) continue;
    const bool is_upload = list.way == ParcelWay::kToDevice;
    uint8_t* const to = is_upload ? parcel.array + offset : pinned + place;
    const uint8_t* const from = is_upload ? pinned + place : parcel.array + offset;
    if (parcel.bytes - offset >= kWord) {
      *reinterpret_cast<ParcelWord*>(to) = *reinterpret_cast<const ParcelWord*>(from);
    } else {
      for (int64_t byte = 0; byte < parcel.bytes - offset; ++byte) to[byte] = from[byte];
    }
    return;
  }
}

// Those that wait to be sent, all the same way. Their arrays must stay what they are until then.
class CudaParcels {
 public:
  // `pinned` is what places count from.
  CudaParcels(cudaStream_t stream, uint8_t* pinned) : stream_(stream), pinned_(pinned) {}

  // Places rise until all are sent.
  void Add(ParcelWay way, const Parcel& parcel) {
    if (way != waiting_.way || waiting_.count == ParcelList::kMost) Send();
    waiting_.way = way;
    waiting_.parcels[waiting_.count++] = parcel;
  }

  void Send() {
    const int count = waiting_.count;
    if (count == 0) return;
    if (count == 1) {
      Copy(waiting_.parcels[0]);
    } else {
      Move();
    }
    waiting_.count = 0;
  }

  // Nobody is there any more who wants them.
  void Drop() { waiting_.count = 0; }

 private:
  static constexpr int kThreadsPerBlock = 128;

  void Move() {
    constexpr int64_t kWord = sizeof(ParcelWord);
    const Parcel& last = waiting_.parcels[waiting_.count - 1];
    const int64_t begin = waiting_.parcels[0].place;
    const int64_t words = (last.place + last.bytes - begin + kWord - 1) / kWord;
    cudaLaunchConfig_t config = {};
    config.gridDim = dim3(static_cast<unsigned>((words + kThreadsPerBlock - 1) / kThreadsPerBlock));
    config.blockDim = dim3(static_cast<unsigned>(kThreadsPerBlock));
    config.stream = stream_;
    CheckCuda(cudaLaunchKernelEx(&config, MoveParcelsKernel, pinned_, begin, words, waiting_),
              "move small arrays");
  }

  void Copy(const Parcel& parcel) {
    const auto size = static_cast<size_t>(parcel.bytes);
    uint8_t* const staged = pinned_ + parcel.place;
    if (waiting_.way == ParcelWay::kToDevice) {
      CheckCuda(cudaMemcpyAsync(parcel.array, staged, size, cudaMemcpyHostToDevice, stream_),
                "copy to the device");
    } else {
      CheckCuda(cudaMemcpyAsync(staged, parcel.array, size, cudaMemcpyDeviceToHost, stream_),
                "copy from the device");
    }
  }

  cudaStream_t stream_;
  uint8_t* pinned_;
  ParcelList waiting_;
};

}  // namespace amhex
