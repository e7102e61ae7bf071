// Arrays, and structures of views on arrays, copied to where bodies run.
#pragma once

#include <cstdint>
#include <cstring>
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

  // The same structure on copies that live as long as this. Its small arrays travel together.
  template <class Views>
  Views Upload(Views views) {
    std::vector<uint8_t> small;
    views.VisitArrays([&](auto& view) {
      if (!IsSmall(view)) return;
      const auto* const from = reinterpret_cast<const uint8_t*>(view.data);
      small.resize(NextPlace(small.size()));
      small.insert(small.end(), from, from + BytesOf(view));
    });
    uint8_t* const there = UploadBytes(small.data(), static_cast<int64_t>(small.size()));
    size_t end = 0;
    views.VisitArrays([&](auto& view) {
      if (!IsSmall(view)) {
        view = UploadArray(view);
        return;
      }
      const size_t place = NextPlace(end);
      end = place + static_cast<size_t>(BytesOf(view));
      view.data = reinterpret_cast<decltype(view.data)>(view.size == 0 ? nullptr : there + place);
    });
    return views;
  }

  template <class T>
  ArrayView<T> UploadArray(ArrayView<T> host) {
    const auto* const from = reinterpret_cast<const uint8_t*>(host.data);
    return {reinterpret_cast<T*>(UploadBytes(from, BytesOf(host))), host.size};
  }

  // An array without contents, to be written by whoever holds the view.
  template <class T>
  ArrayView<T> AddArray(int64_t count) {
    const int64_t bytes = count * static_cast<int64_t>(sizeof(T));
    Buffer<E, uint8_t>& buffer = buffers_.emplace_back(executor_.template Alloc<uint8_t>(bytes));
    return {reinterpret_cast<T*>(buffer.View().data), count};
  }

  // From one of these arrays, which nobody is writing; those that travelled alone or were added.
  // The host has it once these have synchronized.
  template <class T>
  void CopyOutLater(ArrayView<const T> array, T* host) const {
    CopyBufferOut(reinterpret_cast<const uint8_t*>(array.data), reinterpret_cast<uint8_t*>(host));
  }
  void Synchronize() const { executor_.Synchronize(); }
  // For whoever writes arrays that were added.
  E& executor() { return executor_; }

  // From all arrays of `there`, which Upload made of a structure of arrays as long as those of
  // `host`, and which nobody is writing. The small ones come together; waits once.
  template <class Views>
  void Download(Views there, Views host) const {
    std::vector<uint8_t*> targets;
    host.VisitArrays([&](auto& view) { targets.push_back(reinterpret_cast<uint8_t*>(view.data)); });
    const uint8_t* first = nullptr;  // of the small ones
    size_t next = 0;
    there.VisitArrays([&](auto& view) {
      uint8_t* const target = targets[next++];
      const auto* const from = reinterpret_cast<const uint8_t*>(view.data);
      if (!IsSmall(view)) CopyBufferOut(from, target);
      if (IsSmall(view) && view.size > 0 && first == nullptr) first = from;
    });
    std::vector<uint8_t> small(static_cast<size_t>(SizeOfBuffer(first)));
    if (first != nullptr) CopyBufferOut(first, small.data());
    executor_.Synchronize();
    next = 0;
    there.VisitArrays([&](auto& view) {
      uint8_t* const target = targets[next++];
      if (!IsSmall(view) || view.size == 0) return;
      const auto* const from = reinterpret_cast<const uint8_t*>(view.data);
      std::memcpy(target, small.data() + (from - first), static_cast<size_t>(BytesOf(view)));
    });
  }

  // Memory of the copies.
  template <class Views>
  static int64_t Bytes(Views views) {
    int64_t sum = 0;
    views.VisitArrays([&sum](auto& view) { sum += BytesOf(view); });
    return sum;
  }

 private:
  // Gathering so much takes the host less than one more copy to a device, some ten microseconds.
  static constexpr int64_t kSmallArray = int64_t{1} << 16;
  static constexpr size_t kAlignment = 32;  // what a device reads at once

  template <class View>
  static int64_t BytesOf(const View& view) {
    return view.size * static_cast<int64_t>(sizeof(*view.data));
  }
  template <class View>
  static bool IsSmall(const View& view) {
    return BytesOf(view) <= kSmallArray;
  }
  static size_t NextPlace(size_t end) { return (end + kAlignment - 1) / kAlignment * kAlignment; }

  uint8_t* UploadBytes(const uint8_t* host, int64_t bytes) {
    if (bytes == 0) return nullptr;
    return buffers_.emplace_back(Uploaded(executor_, host, bytes)).View().data;
  }
  int64_t SizeOfBuffer(const uint8_t* data) const {
    for (const Buffer<E, uint8_t>& buffer : buffers_) {
      if (buffer.View().data == data) return buffer.size();
    }
    return 0;
  }
  // The host has it when the executor has been waited for.
  void CopyBufferOut(const uint8_t* data, uint8_t* host) const {
    for (const Buffer<E, uint8_t>& buffer : buffers_) {
      if (buffer.View().data != data) continue;
      executor_.CopyOutLater(buffer, buffer.size(), host);
      return;
    }
  }

  E& executor_;
  std::vector<Buffer<E, uint8_t>> buffers_;
};

}  // namespace amhex
