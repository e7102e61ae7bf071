// `amhex`: from a scan to an at-most-hexa volume mesh, through the service.
#include "cli/commands.h"
#include "cli/exit_codes.h"

namespace amhex::client {
namespace {

int Main(int argc, char** argv) {
  CLI::App app("amhex: from a scan to a volume mesh of hexahedra and what they degenerate to");
  app.set_version_flag("--version", "amhex " AMHEX_CLIENT_VERSION);
  int exit_code = kExitSuccess;
  AddAllCommands(&app, &exit_code);
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
