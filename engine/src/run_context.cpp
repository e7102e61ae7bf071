#include "amhex/run_context.h"

#include <algorithm>

namespace amhex {

const char* StageName(Stage stage) {
  switch (stage) {
    case Stage::kCheckInput:
      return "check_input";
    case Stage::kSampleHull:
      return "sample_hull";
    case Stage::kPopulate:
      return "populate";
    case Stage::kRelax:
      return "relax";
    case Stage::kMatchAndMerge:
      return "match_and_merge";
    case Stage::kExtractTopology:
      return "extract_topology";
    case Stage::kAssemble:
      return "assemble";
    case Stage::kClose:
      return "close";
    case Stage::kPlaceVertices:
      return "place_vertices";
    case Stage::kValidate:
      return "validate";
  }
  return "unknown";
}

absl::Status RunContext::CheckStop() const {
  if (stop_requested_.load(std::memory_order_relaxed)) {
    return absl::CancelledError("the run was cancelled");
  }
  if (Clock::now() >= deadline_) {
    return absl::DeadlineExceededError("the run exceeded its time limit");
  }
  return absl::OkStatus();
}

void RunContext::Report(const Progress& update) {
  const Stage stage = progress_.stage;
  // Stages that repeat a step until nothing changes cannot know their share beforehand; a watcher
  // still never sees a bar go back.
  const double fraction = std::max(progress_.stage_fraction,
                                   part_begin_ + (part_end_ - part_begin_) * update.stage_fraction);
  progress_ = update;
  progress_.stage = stage;
  progress_.stage_fraction = fraction;
  if (on_progress) on_progress(progress_);
}

void RunContext::BeginStage(Stage stage) {
  SetStagePart(0, 1);
  progress_.stage = stage;
  progress_.stage_fraction = 0;
  if (on_progress) on_progress(progress_);
}

void RunContext::EndStage(const StageReport& report) {
  progress_.stage_fraction = 1;
  stage_reports_.push_back(report);
  if (on_progress) on_progress(progress_);
  if (on_stage_done) on_stage_done(report);
}

}  // namespace amhex
