// Answers the batches of hull_batch.h with arrays where bodies run.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "exec/executor.h"
#include "exec/resident_arrays.h"
#include "exec/uploaded_arrays.h"
#include "input/hull_batch.h"

namespace amhex {

// The hull where bodies run, copied there by whoever asks first.
template <class E>
HullView ResidentHull(const HullView& hull, ResidentSlot& slot) {
  return Resident<E>(slot, [&hull](UploadedArrays<E>& arrays) {
    HullView there = arrays.Upload(hull);
    there.packets = {};  // which stay on the host
    return there;
  });
}
// Memory of that copy that is still to be taken.
template <class E>
int64_t ResidentHullBytes(const HullView& hull, const ResidentSlot& slot) {
  return slot != nullptr ? 0 : UploadedArrays<E>::Bytes(hull);
}

// Memory where bodies run, beyond what is there.
template <class E, class Question>
int64_t HullBatchBytes(const HullBatch<Question>& batch) {
  return ResidentHullBytes<E>(batch.hull, *batch.resident) +
         BytesOfViewsThere<E>(batch.question.points) +
         batch.question.points.count() * static_cast<int64_t>(sizeof(typename Question::Answer));
}

// False if it was stopped.
template <class E, class Question>
bool AnswerBatch(E& executor, HullBatch<Question>& batch) {
  using Answer = typename Question::Answer;
  const int64_t count = batch.question.points.count();
  const HullView hull = ResidentHull<E>(batch.hull, *batch.resident);
  UploadedArrays<E> arrays(executor);
  Buffer<E, Answer> answers = executor.template Alloc<Answer>(count);
  Question question = batch.question;
  question.points = ViewsThere(arrays, question.points);
  executor.ForEach("ask the hull", count, AskBody<Question>{hull, question, answers.View()});
  std::vector<Answer> host(static_cast<size_t>(count));
  executor.CopyOut(answers, count, host.data());
  if (executor.Stopped()) return false;
  batch.answers = std::move(host);
  return true;
}

}  // namespace amhex
