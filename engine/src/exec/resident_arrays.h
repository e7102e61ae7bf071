// Copies of arrays that stay where bodies run, for all tasks that read them.
#pragma once

#include <memory>
#include <type_traits>

#include "exec/resident_slot.h"
#include "exec/uploaded_arrays.h"

namespace amhex {

// One copy, on an executor of its own: it outlives those of the tasks.
template <class E, class Views>
class ResidentArrays {
 public:
  template <class Upload>
  explicit ResidentArrays(const Upload& upload) : arrays_(executor_), views_(upload(arrays_)) {}

  const Views& views() const { return views_; }

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
  if (slot == nullptr) slot = std::make_shared<Copy>(upload);
  return static_cast<const Copy*>(slot.get())->views();
}

}  // namespace amhex
