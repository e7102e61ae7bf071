// Runs bodies on one CUDA device, ordered on one stream of its own.
#pragma once

#include <cuda_runtime.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/iterator/transform_iterator.h>

#include <cstdint>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_reduce.cuh>
#include <cub/device/device_scan.cuh>
#include <functional>
#include <string>
#include <utility>

#include "exec/cuda_error.h"
#include "exec/executor.h"

namespace amhex {

// Throws CudaError naming the step; the error is cleared, so that a failed allocation leaves the
// device usable.
inline void CheckCuda(cudaError_t code, const char* description) {
  if (code == cudaSuccess) return;
  cudaGetLastError();
  throw CudaError(std::string(description) + ": " + cudaGetErrorString(code),
                  code == cudaErrorMemoryAllocation);
}

// A stream that ends with its owner.
class CudaStream {
 public:
  CudaStream() {
    CheckCuda(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "create a stream");
  }
  ~CudaStream() { cudaStreamDestroy(stream_); }
  CudaStream(const CudaStream&) = delete;
  CudaStream& operator=(const CudaStream&) = delete;
  cudaStream_t get() const { return stream_; }

 private:
  cudaStream_t stream_ = nullptr;
};

// An array in device memory, allocated and freed in stream order. Elements start undefined.
template <class T>
class DeviceBuffer {
 public:
  DeviceBuffer() = default;
  DeviceBuffer(int64_t size, cudaStream_t stream) : size_(size), stream_(stream) {
    if (size == 0) return;
    const size_t bytes = static_cast<size_t>(size) * sizeof(T);
    const cudaError_t code = cudaMallocAsync(reinterpret_cast<void**>(&data_), bytes, stream);
    if (code != cudaSuccess) {
      data_ = nullptr;
      const std::string text = "allocate " + std::to_string(bytes) + " bytes of device memory";
      CheckCuda(code, text.c_str());
    }
  }
  ~DeviceBuffer() { Free(); }
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
  void Free() {
    if (data_ != nullptr) cudaFreeAsync(data_, stream_);
  }

  T* data_ = nullptr;
  int64_t size_ = 0;
  cudaStream_t stream_ = nullptr;
};

// One thread per element.
template <class Body>
__global__ void ForEachKernel(int64_t count, Body body) {
  const int64_t index = static_cast<int64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (index < count) body(index);
}

struct PackPairBody {
  ArrayView<const uint32_t> key;
  ArrayView<const int32_t> value;
  ArrayView<uint64_t> pair;
  AMHEX_HD void operator()(int64_t i) const {
    pair[i] = (static_cast<uint64_t>(key[i]) << 32) | static_cast<uint32_t>(value[i]);
  }
};

struct UnpackPairBody {
  ArrayView<const uint64_t> pair;
  ArrayView<uint32_t> key;
  ArrayView<int32_t> value;
  AMHEX_HD void operator()(int64_t i) const {
    key[i] = static_cast<uint32_t>(pair[i] >> 32);
    value[i] = static_cast<int32_t>(pair[i]);
  }
};

// One per run; used from one host thread. Every operation throws CudaError when it fails.
class CudaExecutor {
 public:
  template <class T>
  using BufferOf = DeviceBuffer<T>;

  explicit CudaExecutor(std::function<bool()> should_stop = {})
      : should_stop_(std::move(should_stop)) {}

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

  template <class T>
  void CopyOut(const DeviceBuffer<T>& buffer, int64_t count, T* host) {
    if (count > 0) {
      CheckCuda(cudaMemcpyAsync(host, buffer.View().data, Bytes<T>(count), cudaMemcpyDeviceToHost,
                                stream_.get()),
                "copy from the device");
    }
    Synchronize();
  }

  template <class Body>
  void ForEach(const char* description, int64_t count, const Body& body) {
    if (count == 0 || PollStop()) return;
    const int64_t blocks = (count + kThreadsPerBlock - 1) / kThreadsPerBlock;
    ForEachKernel<<<static_cast<unsigned>(blocks), kThreadsPerBlock, 0, stream_.get()>>>(count,
                                                                                         body);
    CheckCuda(cudaGetLastError(), description);
  }

  template <class Body>
  int64_t Reduce(const char* description, int64_t count, const Body& body) {
    const auto values =
        thrust::make_transform_iterator(thrust::counting_iterator<int64_t>(0), body);
    return Sum(description, values, count);
  }

  int64_t ExclusiveScan(DeviceBuffer<int32_t>& values, int64_t count) {
    if (count == 0) return 0;
    int32_t* data = values.View().data;
    const int64_t total = Sum("sum before a scan", data, count);
    size_t bytes = 0;
    CheckCuda(cub::DeviceScan::ExclusiveSum(nullptr, bytes, data, data, count, stream_.get()),
              "size a scan");
    DeviceBuffer<uint8_t> scratch = Alloc<uint8_t>(static_cast<int64_t>(bytes));
    CheckCuda(
        cub::DeviceScan::ExclusiveSum(scratch.View().data, bytes, data, data, count, stream_.get()),
        "scan");
    return total;
  }

  void SortByKey(DeviceBuffer<uint32_t>& keys, DeviceBuffer<int32_t>& values, int64_t count) {
    if (count == 0) return;
    DeviceBuffer<uint64_t> pairs = Alloc<uint64_t>(count);
    DeviceBuffer<uint64_t> sorted = Alloc<uint64_t>(count);
    ForEach("pack pairs", count,
            PackPairBody{ReadOnly(keys.View()), ReadOnly(values.View()), pairs.View()});
    size_t bytes = 0;
    const uint64_t* in = pairs.View().data;
    uint64_t* out = sorted.View().data;
    CheckCuda(cub::DeviceRadixSort::SortKeys(nullptr, bytes, in, out, count, 0, 64, stream_.get()),
              "size a sort");
    DeviceBuffer<uint8_t> scratch = Alloc<uint8_t>(static_cast<int64_t>(bytes));
    CheckCuda(cub::DeviceRadixSort::SortKeys(scratch.View().data, bytes, in, out, count, 0, 64,
                                             stream_.get()),
              "sort");
    ForEach("unpack pairs", count,
            UnpackPairBody{ReadOnly(sorted.View()), keys.View(), values.View()});
  }

  void Synchronize() { CheckCuda(cudaStreamSynchronize(stream_.get()), "run on the device"); }
  bool Stopped() const { return is_stopped_; }
  cudaStream_t stream() const { return stream_.get(); }

  // For kernels written by hand beside ForEach: false once the run should stop.
  bool MayLaunch() { return !PollStop(); }

 private:
  static constexpr int kThreadsPerBlock = 128;

  template <class T>
  static size_t Bytes(int64_t count) {
    return static_cast<size_t>(count) * sizeof(T);
  }

  template <class Iterator>
  int64_t Sum(const char* description, Iterator values, int64_t count) {
    if (count == 0) return 0;
    DeviceBuffer<int64_t> result = Alloc<int64_t>(1);
    const auto sum = [&](void* scratch, size_t& bytes) {
      CheckCuda(cub::DeviceReduce::Reduce(scratch, bytes, values, result.View().data, count,
                                          ::cuda::std::plus<>{}, int64_t{0}, stream_.get()),
                description);
    };
    size_t bytes = 0;
    sum(nullptr, bytes);
    DeviceBuffer<uint8_t> scratch = Alloc<uint8_t>(static_cast<int64_t>(bytes));
    sum(scratch.View().data, bytes);
    int64_t host_result = 0;
    CopyOut(result, 1, &host_result);
    return host_result;
  }

  bool PollStop() {
    if (!is_stopped_ && should_stop_) is_stopped_ = should_stop_();
    return is_stopped_;
  }

  std::function<bool()> should_stop_;
  bool is_stopped_ = false;
  CudaStream stream_;
};

static_assert(Executor<CudaExecutor>);

}  // namespace amhex
