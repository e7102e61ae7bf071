// Arrays, and structures of views on arrays, copied to where bodies run.
#pragma once

#include <cstdint>
#include <type_traits>
#include <vector>

#include "exec/executor.h"

namespace amhex {

// A copy of an array.
template <class E, class T>
Buffer<E, T> Uploaded(E& executor, const T* host, int64_t count) {
  Buffer<E, T> buffer = executor.template Alloc<T>(count);
  executor.CopyIn(host, count, buffer);
  return buffer;
}
template <class E, class T>
Buffer<E, T> Uploaded(E& executor, const std::vector<T>& host) {
  return Uploaded(executor, host.data(), static_cast<int64_t>(host.size()));
}

// Owns the copies. A structure names its views by a member VisitArrays(visit).
template <class E>
class UploadedArrays {
 public:
  explicit UploadedArrays(E& executor) : executor_(executor) {}

  // The same structure on copies that live as long as this.
  template <class Views>
  Views Upload(Views views) {
    views.VisitArrays([this](auto& view) { view = UploadArray(view); });
    return views;
  }

  template <class T>
  ArrayView<const T> UploadArray(ArrayView<const T> host) {
    const int64_t bytes = host.size * static_cast<int64_t>(sizeof(T));
    const Buffer<E, uint8_t>& buffer = buffers_.emplace_back(
        Uploaded(executor_, reinterpret_cast<const uint8_t*>(host.data), bytes));
    return {reinterpret_cast<const T*>(buffer.View().data), host.size};
  }

  // An array without contents, to be written by whoever holds the view; there for all executors.
  template <class T>
  ArrayView<T> AddArray(int64_t count) {
    const int64_t bytes = count * static_cast<int64_t>(sizeof(T));
    Buffer<E, uint8_t>& buffer = buffers_.emplace_back(executor_.template Alloc<uint8_t>(bytes));
    executor_.Synchronize();
    return {reinterpret_cast<T*>(buffer.View().data), count};
  }

  // From one of these arrays, which nobody is writing.
  template <class T>
  void CopyOut(ArrayView<const T> array, T* host) {
    for (const Buffer<E, uint8_t>& buffer : buffers_) {
      if (buffer.View().data != reinterpret_cast<const uint8_t*>(array.data)) continue;
      executor_.CopyOut(buffer, buffer.size(), reinterpret_cast<uint8_t*>(host));
      return;
    }
  }

  // Memory of the copies.
  template <class Views>
  static int64_t Bytes(Views views) {
    int64_t sum = 0;
    views.VisitArrays(
        [&sum](auto& view) { sum += view.size * static_cast<int64_t>(sizeof(*view.data)); });
    return sum;
  }

 private:
  E& executor_;
  std::vector<Buffer<E, uint8_t>> buffers_;
};

}  // namespace amhex
