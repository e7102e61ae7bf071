// Copies of arrays that stay where bodies run, for all tasks that read them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <vector>

#include "exec/resident_slot.h"
#include "exec/uploaded_arrays.h"

namespace amhex {

// One copy, on an executor of its own: it outlives those of the tasks.
template <class E, class Views>
class ResidentArrays {
 public:
  template <class Upload>
  explicit ResidentArrays(const Upload& upload) : arrays_(executor_), views_(upload(arrays_)) {}

  // Until then other executors may not see what it holds.
  void Synchronize() { executor_.Synchronize(); }

  const Views& views() const { return views_; }
  const UploadedArrays<E>& arrays() const { return arrays_; }

 private:
  E executor_;
  UploadedArrays<E> arrays_;
  Views views_;
};

// What `upload(arrays)` made of an UploadedArrays the first time that it was asked for with this
// slot, which must always be with the same kind of upload. The views hold for as long as the slot.
template <class E, class Upload>
auto Resident(ResidentSlot& slot, const Upload& upload) {
  using Copy = ResidentArrays<E, std::invoke_result_t<Upload, UploadedArrays<E>&>>;
  if (slot == nullptr) {
    const auto copy = std::make_shared<Copy>(upload);
    copy->Synchronize();
    slot = copy;
  }
  return static_cast<const Copy*>(slot.get())->views();
}

// Where the arrays are of a structure of views that `make(arrays)` gives, if nobody has made it
// with this slot.
template <class E, class Make>
std::vector<const void*> ResidentData(ResidentSlot& slot, const Make& make) {
  return Resident<E>(slot, [&make](UploadedArrays<E>& arrays) {
    std::vector<const void*> data;
    auto there = make(arrays);
    there.VisitArrays([&data](auto& view) { data.push_back(view.data); });
    return data;
  });
}

// The same structure on the copies that the first one with this slot made of its arrays, or that
// were made there (ResidentData). Those are what they were; other members may have changed since.
template <class E, class Views>
Views OnResidentArrays(ResidentSlot& slot, const Views& host) {
  const std::vector<const void*> copies =
      ResidentData<E>(slot, [&host](UploadedArrays<E>& arrays) { return arrays.Upload(host); });
  Views there = host;
  size_t next = 0;
  there.VisitArrays(
      [&](auto& view) { view.data = static_cast<decltype(view.data)>(copies[next++]); });
  return there;
}

// Host arrays as bodies need them. A structure of views may name the slot where its copy stays
// (`ResidentSlot* resident`, perhaps null); others are copied for `arrays`.
template <class E, class Views>
Views ViewsThere(UploadedArrays<E>& arrays, const Views& host) {
  if constexpr (requires { *host.resident; }) {
    if (host.resident != nullptr) return OnResidentArrays<E>(*host.resident, host);
  }
  return arrays.Upload(host);
}

// Memory of the copy that this still takes.
template <class E, class Views>
int64_t BytesOfViewsThere(const Views& host) {
  if constexpr (requires { *host.resident; }) {
    if (host.resident != nullptr && *host.resident != nullptr) return 0;
  }
  return UploadedArrays<E>::Bytes(host);
}

}  // namespace amhex
