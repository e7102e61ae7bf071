// How a run is watched, stopped and bounded. The engine neither logs nor counts: it tells this.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "amhex/params.h"
#include "amhex/vec3.h"
#include "amhex/volume_mesh.h"

namespace amhex {

// The pipeline's stages in their order. `kStageCount` is reported by every complete run.
enum class Stage : uint8_t {
  kCheckInput = 0,   // finite, in range, encloses volume; winding numbers; frame
  kSampleHull,       // samples with normals and principal directions, section 4.3
  kPopulate,         // sites: fields or grid, section 4.1
  kRelax,            // Lloyd relaxation, sections 4.1 to 4.4
  kMatchAndMerge,    // cubes, matches, merge sets, cuts, section 5.1
  kExtractTopology,  // faces, penta-loops, primitives, section 5.2 I-II
  kAssemble,         // section 5.2 III
  kClose,            // what assembly left open is filled
  kPlaceVertices,    // onto hull and features; raise the minimum quality
  kValidate,         // the law, and the statistics
};
inline constexpr int kStageCount = 10;

// Lower-case name with underscores, e.g. "match_and_merge".
const char* StageName(Stage stage);

// One finished stage.
struct StageReport {
  Stage stage = Stage::kCheckInput;
  double wall_seconds = 0;
  double device_seconds = 0;      // 0 on the CPU backend
  int64_t peak_memory_bytes = 0;  // of the process, when the stage ended
};

// Where a run stands; cheap to copy.
struct Progress {
  Stage stage = Stage::kCheckInput;
  double stage_fraction = 0;  // [0, 1]
  int32_t iteration = 0;      // of iteration_count, while relaxing
  int32_t iteration_count = 0;
  double mean_movement = 0;  // edge lengths, while relaxing
  int64_t site_count = 0;    // once known
  int64_t cell_count = 0;    // once cells exist
  CellCounts cells_by_type{};
  // Over the cells so far, each by its least; not positive while there are cells that fold.
  double min_scaled_jacobian = 0;
  double average_scaled_jacobian = 0;
};

// Handed to every stage. Thread-compatible: the engine calls the observers from one thread at a
// time; `RequestStop` may be called from any thread at any time.
class RunContext {
 public:
  using Clock = std::chrono::steady_clock;

  std::function<void(const Progress&)> on_progress;       // may be empty
  std::function<void(const StageReport&)> on_stage_done;  // may be empty

  void RequestStop() { stop_requested_.store(true, std::memory_order_relaxed); }
  void SetDeadline(Clock::time_point deadline) { deadline_ = deadline; }

  // True once the run should end; polled at least every 100 ms by every stage.
  bool ShouldStop() const {
    return stop_requested_.load(std::memory_order_relaxed) || Clock::now() >= deadline_;
  }
  // OK, CANCELLED or DEADLINE_EXCEEDED.
  absl::Status CheckStop() const;

  // Records and publishes; `progress.stage` is set by the pipeline.
  void Report(const Progress& update);
  const Progress& progress() const { return progress_; }
  const std::vector<StageReport>& stage_reports() const { return stage_reports_; }

  // For the pipeline only (stage.h, trials.cpp).
  // Until the stage ends or this is called again, a stage's whole is this part of what is reported.
  void SetStagePart(double begin, double end) { part_begin_ = begin, part_end_ = end; }
  void BeginStage(Stage stage);
  void EndStage(const StageReport& report);

 private:
  std::atomic<bool> stop_requested_{false};
  Clock::time_point deadline_ = Clock::time_point::max();
  Progress progress_;
  double part_begin_ = 0, part_end_ = 1;  // of the stage
  std::vector<StageReport> stage_reports_;
};

}  // namespace amhex
