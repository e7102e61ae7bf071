// amhex picture: a mesh file as a PNG.
#include <memory>

#include "absl/strings/str_cat.h"
#include "cli/commands.h"
#include "cli/exit_codes.h"
#include "cli/shared_flags.h"
#include "formats/mesh_file.h"

namespace amhex::client {
namespace {

struct PictureFlags {
  std::string mesh, output, cut, size;
};

int RunPicture(const PictureFlags& flags) {
  const absl::StatusOr<MeshDocument> document = ReadMeshFile(flags.mesh);
  if (!document.ok()) return Fail(document.status(), kExitInput);
  const auto options = PictureOptionsFrom(flags.cut, flags.size, document->mesh);
  if (!options.ok()) return Fail(options.status(), kExitUsage);
  const absl::StatusOr<Image> image = DrawMesh(document->mesh, *options);
  if (!image.ok()) return Fail(image.status(), kExitInput);
  const absl::Status status = WritePng(*image, flags.output);
  return status.ok() ? kExitSuccess : Fail(status, kExitOutput);
}

}  // namespace

void AddPictureCommand(CLI::App* app, int* exit_code) {
  auto flags = std::make_shared<PictureFlags>();
  CLI::App* command = app->add_subcommand(
      "picture",
      "Draw a mesh, cut open: hexahedra inside bluish, other cells yellow, the hull light");
  command->alias("render");
  command->add_option("mesh", flags->mesh, absl::StrCat("Volume mesh: ", kMeshExtensions))
      ->required();
  command->add_option("-o,--output", flags->output, "PNG file")->required();
  command->add_option(
      "--cut", flags->cut,
      "Where to cut: x, y or z, or as in y:0.3; none; default: the largest section");
  command->add_option("--size", flags->size, "Size in pixels, as in 1200x900");
  command->callback([flags, exit_code] { *exit_code = RunPicture(*flags); });
}

}  // namespace amhex::client
