// The subcommands of `amhex`. Each adds itself to the command line and, when chosen, leaves its
// exit code in `*exit_code`.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace amhex::client {

void AddMeshCommand(CLI::App* app, int* exit_code);
void AddSubmitCommand(CLI::App* app, int* exit_code);
void AddWatchCommand(CLI::App* app, int* exit_code);
void AddFetchCommand(CLI::App* app, int* exit_code);
void AddListCommand(CLI::App* app, int* exit_code);
void AddCancelCommand(CLI::App* app, int* exit_code);
void AddDeleteCommand(CLI::App* app, int* exit_code);
void AddInfoCommand(CLI::App* app, int* exit_code);
void AddDemoCommand(CLI::App* app, int* exit_code);
void AddConvertCommand(CLI::App* app, int* exit_code);
void AddReportCommand(CLI::App* app, int* exit_code);
void AddBenchCommand(CLI::App* app, int* exit_code);
void AddCompletionCommand(CLI::App* app, int* exit_code);
void AddManualCommand(CLI::App* app, int* exit_code);
void AddPictureCommand(CLI::App* app, int* exit_code);

// All of them, with the help texts' form and the words for a line that cannot be understood.
void AddAllCommands(CLI::App* app, int* exit_code);

// The manual page in troff; `app` has all commands.
std::string ManualPage(const CLI::App& app);

}  // namespace amhex::client
