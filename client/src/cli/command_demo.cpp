// amhex demo: inputs out of nothing.
#include <cstdio>
#include <memory>

#include "cli/commands.h"
#include "cli/exit_codes.h"
#include "cli/load_input.h"
#include "demo/scanner.h"
#include "demo/shapes.h"
#include "demo/surface.h"
#include "formats/draco_encoder.h"
#include "formats/hull_writer.h"

namespace amhex::client {
namespace {

struct DemoFlags {
  std::string output = "demo.drc", shape = "bracket";
  ScanOptions scan;
  bool surface = false, without_normals = false;
  int resolution = kDefaultContourResolution;
};

absl::StatusOr<InputHull> MakeDemo(const DemoFlags& flags) {
  const absl::StatusOr<Shape> shape = MakeShape(flags.shape);
  if (!shape.ok()) return shape.status();
  if (flags.surface) {
    absl::StatusOr<TriangleMesh> mesh = ContourShape(*shape, flags.resolution);
    if (!mesh.ok()) return mesh.status();
    return InputHull(*std::move(mesh));
  }
  absl::StatusOr<Scan> scan = ScanShape(*shape, flags.scan);
  if (!scan.ok()) return scan.status();
  if (flags.without_normals) scan->cloud.normals.clear();
  return InputHull(std::move(scan->cloud));
}

int RunDemo(const DemoFlags& flags) {
  if (!HullFormatOfPath(flags.output)) {
    return Fail(absl::InvalidArgumentError(flags.output + ": unknown extension; known are " +
                                           kHullExtensions),
                kExitUsage);
  }
  if (HullFormatOfPath(flags.output) == HullFormat::kStl && !flags.surface) {
    return Fail(absl::InvalidArgumentError(flags.output +
                                           ": STL holds surfaces, not scans; --surface writes one"),
                kExitUsage);
  }
  const absl::StatusOr<InputHull> hull = MakeDemo(flags);
  if (!hull.ok()) return Fail(hull.status(), kExitUsage);
  // Far below the scan's noise and the surface's grid, and small to send.
  constexpr double kTolerancePerDiagonal = 2e-5;
  const absl::Status status =
      WriteHullFile(*hull, flags.output, kTolerancePerDiagonal * BoxOf(*hull).Diagonal());
  if (!status.ok()) return Fail(status, kExitOutput);
  std::printf("%s: %s of the %s\n", flags.output.c_str(), DescribeHull(*hull).c_str(),
              flags.shape.c_str());
  return kExitSuccess;
}

}  // namespace

void AddDemoCommand(CLI::App* app, int* exit_code) {
  auto flags = std::make_shared<DemoFlags>();
  CLI::App* command = app->add_subcommand(
      "demo", "Write a generated scan: a machined bracket as several scanners see it");
  command
      ->add_option("-o,--out,--output", flags->output,
                   "File to write: .drc .ply .obj .off .xyz; with --surface also .stl")
      ->type_name("FILE")
      ->capture_default_str();
  command->add_option("--shape", flags->shape, "What to scan")
      ->check(CLI::IsMember(ShapeNames()))
      ->type_name("")
      ->capture_default_str();
  command->add_option("--points", flags->scan.point_count, "Points of the scan")
      ->type_name("N")
      ->capture_default_str();
  command
      ->add_option("--noise", flags->scan.noise,
                   "Standard deviation of the noise in model units; by default 0.0003 of the "
                   "diagonal")
      ->type_name("LENGTH");
  command->add_option("--seed", flags->scan.seed, "Same seed, same scan")
      ->type_name("N")
      ->capture_default_str();
  command->add_flag("--no-normals", flags->without_normals, "Leave the normals out");
  command->add_flag("--surface", flags->surface, "Write the closed surface instead of a scan");
  command
      ->add_option("--resolution", flags->resolution,
                   "Grid cells along the longest side of the surface")
      ->type_name("N")
      ->capture_default_str();
  command->footer(
      "Examples:\n"
      "  amhex demo -o scan.drc\n"
      "  amhex demo --shape torus --points 5000 --no-normals -o torus.ply\n"
      "  amhex demo --surface -o bracket.stl");
  command->callback([flags, exit_code] { *exit_code = RunDemo(*flags); });
}

}  // namespace amhex::client
