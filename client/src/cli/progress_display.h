// Shows on stderr where a job stands: one live line on a terminal, plain lines elsewhere.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "amhex/v1/job.pb.h"
#include "amhex/v1/meshing_service.pb.h"

namespace amhex::client {

class ProgressDisplay {
 public:
  // kEvents: JSON lines on stdout (progress_events.h).
  enum class Style { kSilent, kPlain, kLive, kEvents };

  // Live on a terminal, else plain.
  static Style StyleOfStderr();

  // "auto", "live", "plain", "events" or "none".
  static Style StyleOfWord(const std::string& word);
  Style style() const { return style_; }

  explicit ProgressDisplay(Style style) : style_(style), begin_(absl::Now()) {}
  ~ProgressDisplay() { Clear(); }

  void OnFrame(const amhex::v1::WatchJobResponse& frame);
  // Said once per outage, however often it is tried.
  void OnReconnect(const absl::Status& status);
  void OnTransfer(const char* what, int64_t done, int64_t total);
  // A line that stays.
  void Say(const std::string& line);
  // Removes the live line.
  void Clear();

 private:
  void OnJob(const amhex::v1::Job& job);
  void OnProgress(const amhex::v1::Progress& progress);
  void OnStage(const amhex::v1::StageReport& report);
  void Live(const std::string& line);

  Style style_;
  absl::Time begin_;
  absl::Time last_plain_ = absl::InfinitePast();
  amhex::v1::Stage timed_stage_ = amhex::v1::STAGE_UNSPECIFIED;
  absl::Time stage_begin_;
  amhex::v1::Stage plain_stage_ = amhex::v1::STAGE_UNSPECIFIED;
  amhex::v1::Job::State state_ = amhex::v1::Job::STATE_UNSPECIFIED;
  int32_t attempt_ = 0;
  int stages_shown_ = 0;  // of this attempt
  bool connection_lost_ = false;
  bool live_line_shown_ = false;
};

// "match and merge" for STAGE_MATCH_AND_MERGE.
std::string StageWords(amhex::v1::Stage stage);

// "iteration 60/150, movement 0.012, 9512 cells, 93.1 % hexahedra": what is known yet.
std::string DescribeProgress(const amhex::v1::Progress& progress);

// "this stage about 12 s more": what the stage's speed so far says, after its first seconds;
// empty before. Nobody knows how long the stages after it will take.
std::string DescribeRemaining(double stage_fraction, absl::Duration stage_elapsed);

}  // namespace amhex::client
