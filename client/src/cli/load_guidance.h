// Guidance from the command line: files of guide samples, planes, orientations.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"

namespace amhex::client {

struct GuidanceFlags {
  std::vector<std::string> sample_files;
  std::vector<std::string> planes;
  std::vector<std::string> orientation_files;
};
// --guides, --guide-plane, --orientations; each may be given more than once.
void AddGuidanceFlags(CLI::App* command, GuidanceFlags* flags);

// Errors name the file and line, or the flag's value.
absl::StatusOr<Guidance> LoadGuidance(const GuidanceFlags& flags);

// "3042 guide samples, 1 guide plane"; empty without guidance.
std::string DescribeGuidance(const Guidance& guidance);

}  // namespace amhex::client
