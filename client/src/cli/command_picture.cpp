// amhex picture: a mesh file as a PNG.
#include <memory>

#include "absl/strings/str_cat.h"
#include "cli/commands.h"
#include "cli/exit_codes.h"
#include "cli/shared_flags.h"
#include "formats/mesh_file.h"

namespace amhex::client {
namespace {

struct DrawFlags {
  std::string mesh, output, input;
  PictureFlags look;
};

int RunPicture(const DrawFlags& flags) {
  absl::StatusOr<MeshDocument> document = ReadMeshFile(flags.mesh);
  if (!document.ok()) return Fail(document.status(), kExitInput);
  const absl::Status measured = MeasureDistances(flags.input, &*document);
  if (!measured.ok()) return Fail(measured, kExitInput);
  return WritePicture(*document, flags.look, flags.output);
}

}  // namespace

void AddPictureCommand(CLI::App* app, int* exit_code) {
  auto flags = std::make_shared<DrawFlags>();
  CLI::App* command =
      app->add_subcommand("picture", "Draw a mesh, cut open: hexahedra bluish, other cells yellow");
  command->alias("render");
  command->add_option("mesh", flags->mesh, absl::StrCat("Volume mesh: ", kMeshExtensions))
      ->type_name("FILE")
      ->required();
  command->add_option("-o,--output", flags->output, "PNG file")->type_name("FILE")->required();
  AddPictureFlags(command, &flags->look);
  command->add_option("--input", flags->input, kInputHelp)->type_name("FILE");
  command->footer(
      "Examples:\n"
      "  amhex picture part.vtu -o part.png\n"
      "  amhex picture part.vtu -o worst.png --cut y:0.3 --colour quality\n"
      "  amhex picture part.vtu -o far.png --cut none --colour distance --input part.stl");
  command->callback([flags, exit_code] { *exit_code = RunPicture(*flags); });
}

}  // namespace amhex::client
