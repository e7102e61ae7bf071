// The subcommands of `amhex`. Each adds itself to the command line and, when chosen, leaves its
// exit code in `*exit_code`.
#pragma once

#include <CLI/CLI.hpp>

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
void AddPictureCommand(CLI::App* app, int* exit_code);

}  // namespace amhex::client
