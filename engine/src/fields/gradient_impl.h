// One solve of gradient_task.h with arrays where bodies run.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "exec/executor.h"
#include "exec/resident_arrays.h"
#include "exec/uploaded_arrays.h"
#include "fields/gradient_loop.h"
#include "fields/gradient_task.h"

namespace amhex::fields {

// One object per task.
template <class E, class Operator>
class GradientSolve {
 public:
  GradientSolve(E& executor, GradientTask& task)
      : executor_(executor), task_(task), arrays_(executor), loop_(executor, task.node_count) {}

  // Memory where bodies run, beyond what is there.
  static int64_t Bytes(const GradientTask& task) {
    const Operator& matrix = std::get<Operator>(task.matrix);
    const bool has_links = task.links != nullptr && *task.links != nullptr;
    return GradientLoop<E, Operator>::Bytes(task.node_count) + UploadedArrays<E>::Bytes(matrix) -
           (has_links ? UploadedArrays<E>::Bytes(matrix.links) : 0);
  }

  // False if it was stopped.
  bool Run() {
    Upload();
    loop_.Prepare();
    loop_.Solve(task_.limits);
    std::vector<float> x(static_cast<size_t>(loop_.unknowns()));
    int64_t counts[kCountsSize] = {};
    executor_.CopyOutLater(loop_.x, loop_.unknowns(), x.data());
    executor_.CopyOutLater(loop_.counts(), kCountsSize, counts);
    executor_.Synchronize();
    if (executor_.Stopped()) return false;
    *task_.x = std::move(x);
    task_.iterations = static_cast<int32_t>(counts[kIterationsDone]);
    return true;
  }

 private:
  void Upload() {
    Operator host = std::get<Operator>(task_.matrix);
    const NodeLinks links = std::exchange(host.links, {});
    loop_.matrix = arrays_.Upload(host);
    loop_.matrix.links =
        task_.links == nullptr ? arrays_.Upload(links) : OnResidentArrays<E>(*task_.links, links);
    loop_.right_side = Uploaded(executor_, task_.right_side.data, loop_.unknowns());
  }

  E& executor_;
  GradientTask& task_;
  UploadedArrays<E> arrays_;  // of the matrix
  GradientLoop<E, Operator> loop_;
};

}  // namespace amhex::fields
