// `amhex`: from a scan to an at-most-hexa volume mesh, through the service.
#include "cli/commands.h"
#include "cli/exit_codes.h"

namespace amhex::client {
namespace {

int Main(int argc, char** argv) {
  CLI::App app("amhex: from a scan to a volume mesh of hexahedra and what they degenerate to");
  app.require_subcommand(1);
  app.set_version_flag("--version", "amhex " AMHEX_CLIENT_VERSION);
  app.footer(ExitCodeHelp());
  int exit_code = kExitSuccess;
  AddMeshCommand(&app, &exit_code);
  AddSubmitCommand(&app, &exit_code);
  AddWatchCommand(&app, &exit_code);
  AddFetchCommand(&app, &exit_code);
  AddListCommand(&app, &exit_code);
  AddCancelCommand(&app, &exit_code);
  AddDeleteCommand(&app, &exit_code);
  AddInfoCommand(&app, &exit_code);
  AddDemoCommand(&app, &exit_code);
  AddConvertCommand(&app, &exit_code);
  AddReportCommand(&app, &exit_code);
  AddPictureCommand(&app, &exit_code);
  AddBenchCommand(&app, &exit_code);
  AddCompletionCommand(&app, &exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitSuccess : kExitUsage;
  }
  return exit_code;
}

}  // namespace
}  // namespace amhex::client

int main(int argc, char** argv) { return amhex::client::Main(argc, argv); }
