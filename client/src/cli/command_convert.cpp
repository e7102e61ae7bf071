// amhex convert: a mesh file in another format.
#include <cstdio>
#include <memory>

#include "absl/strings/str_cat.h"
#include "cells/mesh_check.h"
#include "cli/commands.h"
#include "cli/exit_codes.h"
#include "cli/shared_flags.h"
#include "formats/mesh_file.h"

namespace amhex::client {
namespace {

struct ConvertFlags {
  std::string mesh, output;
  bool solver_ready = false;
};

int RunConvert(const ConvertFlags& flags) {
  if (!IsWritableMeshPath(flags.output)) {
    return Fail(
        absl::InvalidArgumentError(absl::StrCat(flags.output, ": unknown extension; ",
                                                "meshes are written to ", kMeshOutputExtensions)),
        kExitUsage);
  }
  absl::StatusOr<MeshDocument> document = ReadMeshFile(flags.mesh);
  if (!document.ok()) return Fail(document.status(), kExitInput);
  if (const absl::Status status = CheckMesh(document->mesh); !status.ok()) {
    return Fail(status, kExitInput);
  }
  absl::Status status;
  if (flags.solver_ready) status = DivideForSolvers(&*document);
  if (status.ok()) status = WriteMeshFile(*document, flags.output);
  if (!status.ok()) return Fail(status, kExitOutput);
  if (flags.solver_ready) std::printf("%s\n", DescribeDivision(*document).c_str());
  std::printf("%s: %zu cells, %zu vertices\n", flags.output.c_str(), document->mesh.corners.size(),
              document->mesh.vertices.size());
  return kExitSuccess;
}

}  // namespace

void AddConvertCommand(CLI::App* app, int* exit_code) {
  auto flags = std::make_shared<ConvertFlags>();
  CLI::App* command = app->add_subcommand("convert", "Write a mesh file in another format");
  command->add_option("mesh", flags->mesh, absl::StrCat("Volume mesh: ", kMeshExtensions))
      ->type_name("FILE")
      ->required();
  command->add_option("-o,--output", flags->output, absl::StrCat("File: ", kMeshOutputExtensions))
      ->type_name("FILE")
      ->required();
  command->add_flag("--solver-ready", flags->solver_ready, kSolverReadyHelp);
  command->footer(
      "Examples:\n"
      "  amhex convert part.vtu -o part.inp --solver-ready\n"
      "  amhex convert part.vtu -o case/constant/polyMesh --solver-ready\n"
      "  amhex convert part.vtu -o hull.stl");
  command->callback([flags, exit_code] { *exit_code = RunConvert(*flags); });
}

}  // namespace amhex::client
