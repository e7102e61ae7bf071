// Asks the hull about many points at once, where the run computes.
#pragma once

#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "base/status_error.h"
#include "base/status_macros.h"
#include "base/stop_poll.h"
#include "cuda/device_use.h"
#include "exec/cpu_executor.h"
#include "input/answer_in_lanes.h"
#include "input/hull_batch.h"
#include "input/hull_queries.h"

namespace amhex {

// Refers to what it is made of.
class HullAsker {
 public:
  // `device` may be null: then the CPU answers.
  HullAsker(const HullQueries& queries, DeviceUse* device, const StopPoll& poll)
      : queries_(queries), device_(device), poll_(poll) {}

  // The question's answers for all of its points, with the same bits wherever they come from.
  // Errors: CANCELLED, DEADLINE_EXCEEDED, and those of RunOnCuda.
  template <class Question>
  absl::StatusOr<std::vector<typename Question::Answer>> Ask(const Question& question) const {
    HullBatch<Question> batch{queries_.view_if_here(), &queries_.resident(), question, {}, [this] {
                                return poll_.IsToStop();
                              }};
    const auto on_cpu = [&] {
      batch.hull = queries_.view();
      return AnswerOnCpu(batch);
    };
    AMHEX_RETURN_IF_ERROR(RunFor(question.points.count(), &batch, on_cpu));
    return std::move(batch.answers);
  }

  // Likewise for a task that is about so many points; `on_cpu` as of DeviceUse::Run.
  template <class OnCpu>
  absl::Status RunFor(int64_t point_count, const CudaTask& task, const OnCpu& on_cpu) const {
    // On a device, fewer points cost more than they save (a guess: some ten microseconds for every
    // copy and launch, against two per point on the CPU).
    constexpr int64_t kFewestForDevice = 512;
    if (point_count < kFewestForDevice && queries_.is_here()) {
      on_cpu();
    } else {
      AMHEX_RETURN_IF_ERROR(RunWhereChosen(device_, task, on_cpu).status());
    }
    return poll_.Status();
  }
  bool IsToStop() const { return poll_.IsToStop(); }

  // The same for steps without a status: throws RunStopped, or StatusError with the others.
  template <class Question>
  std::vector<typename Question::Answer> AskOrThrow(const Question& question) const {
    auto answers = Ask(question);
    if (answers.ok()) return *std::move(answers);
    poll_.Now();
    throw StatusError(answers.status());
  }

  // For steps that ask in other ways.
  const HullQueries& queries() const { return queries_; }
  DeviceUse* device() const { return device_; }

 private:
  template <class Question>
  static bool AnswerOnCpu(HullBatch<Question>& batch) {
    CpuExecutor executor(batch.should_stop);
    batch.answers.resize(static_cast<size_t>(batch.question.points.count()));
    const ArrayView answers{batch.answers.data(), batch.question.points.count()};
    executor.ForEach("ask the hull", answers.size,
                     AskSomeBody<Question>{batch.hull, batch.question, answers});
    return !executor.Stopped();
  }

  const HullQueries& queries_;
  DeviceUse* device_;
  StopPoll poll_;
};

}  // namespace amhex
