// Asks the hull about many points at once, where the run computes.
#pragma once

#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "base/status_macros.h"
#include "cuda/device_use.h"
#include "exec/cpu_executor.h"
#include "input/hull_batch.h"
#include "input/hull_queries.h"

namespace amhex {

// Refers to what it is made of.
class HullAsker {
 public:
  // `device` may be null: then the CPU answers.
  HullAsker(const HullQueries& queries, DeviceUse* device, const RunContext& run)
      : queries_(queries), device_(device), run_(run) {}

  // The question's answers for all of its points, with the same bits wherever they come from.
  // Errors: CANCELLED, DEADLINE_EXCEEDED, and those of RunOnCuda.
  template <class Question>
  absl::StatusOr<std::vector<typename Question::Answer>> Ask(const Question& question) const {
    HullBatch<Question> batch{
        queries_.view(), &queries_.resident(), question, {}, [this] { return run_.ShouldStop(); }};
    const auto on_cpu = [&batch] { return AnswerOnCpu(batch); };
    // On a device, fewer points cost more than they save (a guess: some ten microseconds for every
    // copy and launch, against two per point on the CPU).
    constexpr int64_t kFewestForDevice = 512;
    if (question.points.count() < kFewestForDevice) {
      on_cpu();
    } else {
      AMHEX_RETURN_IF_ERROR(RunWhereChosen(device_, &batch, on_cpu).status());
    }
    AMHEX_RETURN_IF_ERROR(run_.CheckStop());
    return std::move(batch.answers);
  }

 private:
  template <class Question>
  static bool AnswerOnCpu(HullBatch<Question>& batch) {
    CpuExecutor executor(batch.should_stop);
    batch.answers.resize(static_cast<size_t>(batch.question.points.count()));
    const ArrayView answers{batch.answers.data(), batch.question.points.count()};
    executor.ForEach("ask the hull", answers.size,
                     AskBody<Question>{batch.hull, batch.question, answers});
    return !executor.Stopped();
  }

  const HullQueries& queries_;
  DeviceUse* device_;
  const RunContext& run_;
};

}  // namespace amhex
