#include "cli/load_guidance.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "cli/help.h"
#include "formats/hull_reader.h"
#include "formats/status_macros.h"
#include "formats/text_scanner.h"

namespace amhex::client {
namespace {

absl::Status AddSamples(const std::string& path, Guidance* guidance) {
  AMHEX_ASSIGN_OR_RETURN(const InputHull hull, ReadHullFile(path));
  const auto* cloud = std::get_if<PointCloud>(&hull);
  if (cloud == nullptr || cloud->normals.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": guide samples are a point cloud with normals"));
  }
  for (size_t i = 0; i < cloud->points.size(); ++i) {
    guidance->samples.push_back({cloud->points[i], cloud->normals[i], {}});
  }
  return absl::OkStatus();
}

// "x,y,z,nx,ny,nz"
absl::Status AddPlane(const std::string& text, Guidance* guidance) {
  std::string spaced = text;
  std::replace(spaced.begin(), spaced.end(), ',', ' ');
  TextScanner scanner(spaced);
  GuidePlane plane;
  for (Vec3d* vector : {&plane.point, &plane.normal}) {
    for (int axis = 0; axis < 3; ++axis) {
      const absl::StatusOr<double> number = scanner.NextDouble("a plane's number");
      if (!number.ok()) {
        return absl::InvalidArgumentError(
            absl::StrCat("--guide-plane ", text, ": a plane is x,y,z,nx,ny,nz"));
      }
      (*vector)[axis] = *number;
    }
  }
  guidance->planes.push_back(plane);
  return absl::OkStatus();
}

// A line per sample: its position, a direction, and perhaps a second one.
absl::Status AddOrientations(const std::string& path, Guidance* guidance) {
  AMHEX_ASSIGN_OR_RETURN(const std::string text, ReadWholeFile(path));
  TextScanner scanner(text, '#');
  for (std::string_view word = scanner.NextWord(); !word.empty(); word = scanner.NextWord()) {
    std::vector<double> numbers;
    for (; !word.empty(); word = scanner.NextWordOnLine()) {
      double number = 0;
      if (!ParseDouble(word, &number)) {
        return absl::InvalidArgumentError(
            absl::StrCat(path, ": line ", scanner.line(), ": no number: ", Quoted(word)));
      }
      numbers.push_back(number);
    }
    if (numbers.size() != 6 && numbers.size() != 9) {
      return absl::InvalidArgumentError(absl::StrCat(path, ": line ", scanner.line(), " has ",
                                                     numbers.size(),
                                                     " numbers; a sample has 6 or 9"));
    }
    numbers.resize(9, 0.0);
    const auto vector = [&](size_t i) { return Vec3d{numbers[i], numbers[i + 1], numbers[i + 2]}; };
    guidance->samples.push_back({vector(0), vector(3), vector(6)});
  }
  return absl::OkStatus();
}

std::string Counted(size_t count, const char* what) {
  return absl::StrCat(count, " ", what, count == 1 ? "" : "s");
}

}  // namespace

void AddGuidanceFlags(CLI::App* command, GuidanceFlags* flags) {
  command->option_defaults()->group(kGuidanceGroup);
  command
      ->add_option("--guides", flags->sample_files,
                   "Cloud with normals inside the solid, which cells align to")
      ->type_name("FILE");
  command
      ->add_option("--guide-plane", flags->planes,
                   "Plane that cells align to: a point and the normal")
      ->type_name("x,y,z,nx,ny,nz");
  command
      ->add_option("--orientations", flags->orientation_files,
                   "Text file, a line per sample: x y z and one or two directions")
      ->type_name("FILE");
}

absl::StatusOr<Guidance> LoadGuidance(const GuidanceFlags& flags) {
  Guidance guidance;
  for (const std::string& path : flags.sample_files) {
    AMHEX_RETURN_IF_ERROR(AddSamples(path, &guidance));
  }
  for (const std::string& plane : flags.planes) AMHEX_RETURN_IF_ERROR(AddPlane(plane, &guidance));
  for (const std::string& path : flags.orientation_files) {
    AMHEX_RETURN_IF_ERROR(AddOrientations(path, &guidance));
  }
  return guidance;
}

std::string DescribeGuidance(const Guidance& guidance) {
  std::vector<std::string> parts;
  if (!guidance.samples.empty()) parts.push_back(Counted(guidance.samples.size(), "guide sample"));
  if (!guidance.planes.empty()) parts.push_back(Counted(guidance.planes.size(), "guide plane"));
  return absl::StrJoin(parts, ", ");
}

}  // namespace amhex::client
