// Structures of views, with their arrays copied to where bodies run.
#pragma once

#include <cstdint>
#include <type_traits>
#include <vector>

#include "exec/executor.h"

namespace amhex {

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
    Buffer<E, uint8_t>& buffer = buffers_.emplace_back(executor_.template Alloc<uint8_t>(bytes));
    executor_.CopyIn(reinterpret_cast<const uint8_t*>(host.data), bytes, buffer);
    return {reinterpret_cast<const T*>(buffer.View().data), host.size};
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
