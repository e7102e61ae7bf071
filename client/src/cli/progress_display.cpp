#include "cli/progress_display.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_replace.h"
#include "cli/json.h"
#include "cli/progress_events.h"

namespace amhex::client {
namespace {

namespace v1 = amhex::v1;

constexpr int kBarWidth = 16;
constexpr absl::Duration kPlainInterval = absl::Seconds(5);

double Seconds(const google::protobuf::Duration& duration) {
  return static_cast<double>(duration.seconds()) + 1e-9 * duration.nanos();
}

int TerminalWidth() {
  constexpr int kUsualWidth = 80;
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return kUsualWidth;
  return size.ws_col;
}

// Stages count alike; nobody knows in advance how long each will take.
double OverallFraction(const v1::Progress& progress) {
  const int stage_count = v1::STAGE_ENCODE_RESULT;
  const int before = std::max(0, static_cast<int>(progress.stage()) - 1);
  return std::clamp((before + progress.stage_fraction()) / stage_count, 0.0, 1.0);
}

std::string Bar(double fraction) {
  const int full = static_cast<int>(fraction * kBarWidth);
  return absl::StrCat("[", std::string(static_cast<size_t>(full), '#'),
                      std::string(static_cast<size_t>(kBarWidth - full), '.'), "]");
}

}  // namespace

std::string StageWords(v1::Stage stage) {
  const auto* value = v1::Stage_descriptor()->FindValueByNumber(stage);
  if (value == nullptr) return absl::StrCat("stage ", static_cast<int>(stage));
  return absl::StrReplaceAll(EnumWord(*value), {{"_", " "}});
}

std::string DescribeProgress(const v1::Progress& progress) {
  std::string text;
  const auto add = [&text](const std::string& part) {
    absl::StrAppend(&text, text.empty() ? "" : ", ", part);
  };
  if (progress.iteration_count() > 0) {
    add(absl::StrCat("iteration ", progress.iteration(), "/", progress.iteration_count()));
  }
  if (progress.mean_movement() > 0) {
    add(absl::StrFormat("movement %.3g", progress.mean_movement()));
  }
  if (progress.cell_count() > 0) {
    add(absl::StrFormat("%d of %d cells hexahedra so far (%.1f %%)", progress.hexahedron_count(),
                        progress.cell_count(),
                        100.0 * static_cast<double>(progress.hexahedron_count()) /
                            static_cast<double>(progress.cell_count())));
  } else if (progress.site_count() > 0) {
    add(absl::StrCat(progress.site_count(), " sites"));
  }
  if (progress.min_scaled_jacobian() != 0) {
    add(absl::StrFormat("worst %.3f", progress.min_scaled_jacobian()));
  }
  return text;
}

std::string DescribeRemaining(double stage_fraction, absl::Duration stage_elapsed) {
  // Earlier, a guess would jump about.
  constexpr double kLeastFraction = 0.05;
  constexpr absl::Duration kLeastElapsed = absl::Seconds(2);
  if (stage_fraction < kLeastFraction || stage_fraction >= 1 || stage_elapsed < kLeastElapsed) {
    return "";
  }
  const double seconds =
      absl::ToDoubleSeconds(stage_elapsed) * (1 - stage_fraction) / stage_fraction;
  return absl::StrFormat("this stage about %.0f s more", seconds);
}

ProgressDisplay::Style ProgressDisplay::StyleOfStderr() {
  return isatty(STDERR_FILENO) != 0 ? Style::kLive : Style::kPlain;
}

ProgressDisplay::Style ProgressDisplay::StyleOfWord(const std::string& word) {
  if (word == "live") return Style::kLive;
  if (word == "plain") return Style::kPlain;
  if (word == "events") return Style::kEvents;
  if (word == "none") return Style::kSilent;
  return StyleOfStderr();
}

void ProgressDisplay::Clear() {
  if (!live_line_shown_) return;
  std::fputs("\r\x1b[2K", stderr);
  std::fflush(stderr);
  live_line_shown_ = false;
}

void ProgressDisplay::Say(const std::string& line) {
  if (style_ == Style::kSilent) return;
  if (style_ == Style::kEvents) return PrintEvent(MessageEvent(line));
  Clear();
  std::fprintf(stderr, "%s\n", line.c_str());
}

void ProgressDisplay::Live(const std::string& line) {
  if (style_ != Style::kLive) return;
  // A line that wraps could not be overwritten.
  const std::string shown = line.substr(0, static_cast<size_t>(TerminalWidth() - 1));
  std::fprintf(stderr, "\r\x1b[2K%s", shown.c_str());
  std::fflush(stderr);
  live_line_shown_ = true;
}

void ProgressDisplay::OnTransfer(const char* what, int64_t done, int64_t total) {
  constexpr double kMegabyte = 1e6;
  if (style_ == Style::kEvents) return PrintEvent(TransferEvent(what, done, total));
  Live(absl::StrFormat("%s %.1f of %.1f MB", what, static_cast<double>(done) / kMegabyte,
                       static_cast<double>(total) / kMegabyte));
}

void ProgressDisplay::OnFrame(const v1::WatchJobResponse& frame) {
  if (style_ == Style::kSilent) return;
  if (style_ == Style::kEvents) {
    if (connection_lost_) PrintEvent(ConnectionEvent(absl::OkStatus()));
    connection_lost_ = false;
    return PrintEvent(FrameEvent(frame));
  }
  if (connection_lost_) Say("connected again");
  connection_lost_ = false;
  if (frame.has_job()) OnJob(frame.job());
  if (frame.has_progress()) OnProgress(frame.progress());
  if (frame.has_stage()) OnStage(frame.stage());
}

void ProgressDisplay::OnReconnect(const absl::Status& status) {
  if (!connection_lost_ && style_ == Style::kEvents) {
    PrintEvent(ConnectionEvent(status));
  } else if (!connection_lost_) {
    Say(absl::StrCat("the connection broke, trying again: ", std::string(status.message())));
  }
  connection_lost_ = true;
}

void ProgressDisplay::OnJob(const v1::Job& job) {
  if (job.attempt_count() > 1 && job.attempt_count() != attempt_) {
    Say(absl::StrCat("attempt ", job.attempt_count(), " of ", job.max_attempts()));
    stages_shown_ = 0;
  }
  attempt_ = job.attempt_count();
  // Those that ended before we came, or while the connection was broken.
  while (stages_shown_ < job.stages_size()) OnStage(job.stages(stages_shown_));
  if (job.state() == state_) return;
  state_ = job.state();
  if (state_ == v1::Job::QUEUED) {
    if (style_ == Style::kLive) {
      Live("waiting in the queue");
    } else {
      Say("waiting in the queue");
    }
  }
}

void ProgressDisplay::OnProgress(const v1::Progress& progress) {
  if (progress.stage() != timed_stage_) {
    timed_stage_ = progress.stage();
    stage_begin_ = absl::Now();
  }
  std::string details = DescribeProgress(progress);
  const std::string remaining =
      DescribeRemaining(progress.stage_fraction(), absl::Now() - stage_begin_);
  if (!remaining.empty()) absl::StrAppend(&details, details.empty() ? "" : ", ", remaining);
  const std::string separator = details.empty() ? "" : ", ";
  if (style_ == Style::kLive) {
    Live(absl::StrFormat("%s %3.0f %%  %4.1f s  %s%s%s", Bar(OverallFraction(progress)),
                         100 * OverallFraction(progress),
                         absl::ToDoubleSeconds(absl::Now() - begin_), StageWords(progress.stage()),
                         separator, details));
    return;
  }
  if (progress.stage() == plain_stage_ && absl::Now() < last_plain_ + kPlainInterval) return;
  const bool repeats = progress.stage() == plain_stage_;
  plain_stage_ = progress.stage();
  last_plain_ = absl::Now();
  if (!repeats) return;  // the stage's end says enough about short ones
  Say(absl::StrFormat("  %s: %.0f %%%s%s", StageWords(progress.stage()),
                      100 * progress.stage_fraction(), separator, details));
}

void ProgressDisplay::OnStage(const v1::StageReport& report) {
  constexpr double kMebibyte = 1024.0 * 1024.0;
  ++stages_shown_;
  std::string line = absl::StrFormat("  %-17s %8.3f s", StageWords(report.stage()),
                                     Seconds(report.wall_duration()));
  if (report.has_device_duration() && Seconds(report.device_duration()) > 0) {
    absl::StrAppendFormat(&line, "  (%.3f s on the device)", Seconds(report.device_duration()));
  }
  if (report.peak_memory_bytes() > 0) {
    absl::StrAppendFormat(&line, "  %6.0f MiB",
                          static_cast<double>(report.peak_memory_bytes()) / kMebibyte);
  }
  Say(line);
}

}  // namespace amhex::client
