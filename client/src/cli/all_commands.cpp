#include <memory>

#include "absl/strings/str_cat.h"
#include "cli/commands.h"
#include "cli/exit_codes.h"
#include "cli/help.h"

namespace amhex::client {

void AddAllCommands(CLI::App* app, int* exit_code) {
  app->require_subcommand(1);
  app->formatter(std::make_shared<HelpFormatter>());
  app->failure_message(
      [](const CLI::App* command, const CLI::Error& error) { return UsageError(*command, error); });
  AddMeshCommand(app, exit_code);
  AddSubmitCommand(app, exit_code);
  AddWatchCommand(app, exit_code);
  AddFetchCommand(app, exit_code);
  AddListCommand(app, exit_code);
  AddCancelCommand(app, exit_code);
  AddDeleteCommand(app, exit_code);
  AddInfoCommand(app, exit_code);
  AddDemoCommand(app, exit_code);
  AddConvertCommand(app, exit_code);
  AddReportCommand(app, exit_code);
  AddPictureCommand(app, exit_code);
  AddBenchCommand(app, exit_code);
  AddCompletionCommand(app, exit_code);
  AddManualCommand(app, exit_code);
  // Last: commands take over what there is when they are added, and have examples of their own.
  app->footer(
      absl::StrCat("Examples:\n"
                   "  amhex demo -o scan.drc\n"
                   "  amhex mesh scan.drc -o scan.vtu --report scan.html\n"
                   "  amhex mesh --help\n\n",
                   ExitCodeHelp()));
}

}  // namespace amhex::client
