#include "amhex/params.h"

#include <cmath>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace amhex {
namespace {

// Collects one line per field outside its range, so that a client learns of all of them at once.
class RangeCheck {
 public:
  // Permits [low, high]; not-a-number is outside of every range.
  template <class T>
  void Within(const char* field, T value, T low, T high) {
    if (value >= low && value <= high) return;
    problems_.push_back(
        absl::StrCat(field, " is ", value, ", permitted is [", low, ", ", high, "]"));
  }

  // Permits [0, infinity).
  void FiniteNonNegative(const char* field, double value) {
    if (std::isfinite(value) && value >= 0) return;
    problems_.push_back(absl::StrCat(field, " is ", value, ", permitted is [0, inf)"));
  }

  void NonNegative(const char* field, int64_t value) {
    if (value >= 0) return;
    problems_.push_back(absl::StrCat(field, " is ", value, ", permitted is [0, inf)"));
  }

  // An enumeration whose values are 0 .. last.
  template <class Enum>
  void Known(const char* field, Enum value, Enum last) {
    const int number = static_cast<int>(value);
    if (number <= static_cast<int>(last)) return;
    problems_.push_back(
        absl::StrCat(field, " is ", number, ", permitted is [0, ", static_cast<int>(last), "]"));
  }

  void Refuse(std::string problem) { problems_.push_back(std::move(problem)); }

  absl::Status Verdict() const {
    if (problems_.empty()) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrJoin(problems_, "; "));
  }

 private:
  std::vector<std::string> problems_;
};

}  // namespace

absl::Status Validate(const MeshingParams& params) {
  RangeCheck check;
  const SizingParams& sizing = params.sizing;
  check.Within<int64_t>("sizing.cell_count", sizing.cell_count, 0, 20'000'000);
  check.FiniteNonNegative("sizing.edge_length", sizing.edge_length);
  if (sizing.cell_count > 0 && sizing.edge_length > 0) {
    check.Refuse(absl::StrCat("sizing.cell_count (", sizing.cell_count,
                              ") and sizing.edge_length (", sizing.edge_length,
                              ") are both set, permitted is at most one"));
  }
  check.Within("sizing.trial_count", sizing.trial_count, 0, 12);

  check.Within("input.sharp_angle_degrees", params.input.sharp_angle_degrees, 10.0, 180.0);
  check.Known("input.volume_use", params.input.volume_use, VolumeUse::kSubdivide);

  const RelaxationParams& relaxation = params.relaxation;
  check.Known("relaxation.initialization", relaxation.initialization,
              Initialization::kJitteredGrid);
  check.Within("relaxation.iteration_count", relaxation.iteration_count, -1, 1000);
  check.Within("relaxation.lattice_points_per_site", relaxation.lattice_points_per_site, 8, 4096);
  check.Within("relaxation.regularity_weight", relaxation.regularity_weight, 0.0, 1.0);
  check.Within("relaxation.split_limit", relaxation.split_limit, 7, 26);
  check.Within("relaxation.jitter", relaxation.jitter, 0.0, 0.5);

  check.Within("assembly.min_quality", params.assembly.min_quality, 0.01, 0.9);

  check.Known("run.backend", params.run.backend, Backend::kCuda);
  check.Within("run.thread_count", params.run.thread_count, 0, 1024);
  check.NonNegative("run.memory_limit_bytes", params.run.memory_limit_bytes);
  return check.Verdict();
}

}  // namespace amhex
