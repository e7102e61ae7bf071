// amhex manual: the manual page in troff, from the parser itself, so that it holds what --help
// says.
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "cli/commands.h"
#include "cli/exit_codes.h"
#include "cli/help.h"

namespace amhex::client {
namespace {

// Text of which troff takes nothing for a request or an escape.
std::string Escaped(std::string_view text) {
  const std::string plain =
      absl::StrReplaceAll(absl::string_view(text.data(), text.size()),
                          {{"\\", "\\e"}, {"-", "\\-"}, {"'", "\\(aq"}, {"^", "\\(ha"}});
  return absl::StartsWith(plain, ".") ? "\\&" + plain : plain;
}

std::string Heading(std::string_view text) { return absl::StrCat(".SH ", Escaped(text), "\n"); }

// "--size WxH (default 1200x900)"
std::string NamesOf(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  if (names.empty()) names.push_back(option.get_name());
  const std::string value = ValueOf(option), preset = option.get_default_str();
  std::string text = "\\fB" + Escaped(absl::StrJoin(names, ", ")) + "\\fR";
  if (!value.empty()) absl::StrAppend(&text, " \\fI", Escaped(value), "\\fR");
  if (!preset.empty()) absl::StrAppend(&text, " (default ", Escaped(preset), ")");
  return text;
}

// What stands below a heading such as "Examples:" in a footer, as it is.
std::string Footer(const std::string& footer) {
  std::string text;
  for (absl::string_view line : absl::StrSplit(footer, '\n')) {
    absl::StrAppend(&text, Escaped(std::string_view(line.data(), line.size())), "\n");
  }
  return absl::StrCat(".PP\n.nf\n", text, ".fi\n");
}

std::string Options(const CLI::App& command) {
  std::string text;
  for (const std::string& group : command.get_groups()) {
    std::string options;
    for (const CLI::Option* option : command.get_options()) {
      // Every command has --help.
      if (option->get_group() != group || option == command.get_help_ptr()) continue;
      const std::string environment =
          option->get_envname().empty() ? "" : absl::StrCat(" (or ", option->get_envname(), ")");
      absl::StrAppend(&options, ".TP\n", NamesOf(*option), "\n",
                      Escaped(option->get_description() + environment),
                      option->get_required() ? " (required)" : "", "\n");
    }
    if (options.empty()) continue;
    absl::StrAppend(&text, ".PP\n\\fI", Escaped(group), "\\fR\n", options);
  }
  return text;
}

}  // namespace

std::string ManualPage(const CLI::App& app) {
  std::string text = absl::StrCat(
      ".TH AMHEX 1 \"\" \"", Escaped(app.version()), "\" \"User Commands\"\n", Heading("NAME"),
      "amhex \\- from a scan to an at\\-most\\-hexa volume mesh\n", Heading("SYNOPSIS"),
      ".B amhex\n.I COMMAND\n[options]\n", Heading("DESCRIPTION"),
      "Reads a scan, surface or volume mesh, has it meshed by amhexd, checks what comes back and "
      "writes it. Without a server's address a private server is started for the command.\n");
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    absl::StrAppend(&text, Heading("amhex " + command->get_name()),
                    Escaped(command->get_description()), ".\n");
    for (const std::string& alias : command->get_aliases()) {
      absl::StrAppend(&text, "Also called ", Escaped(alias), ".\n");
    }
    absl::StrAppend(&text, Options(*command));
    if (!command->get_footer().empty()) absl::StrAppend(&text, Footer(command->get_footer()));
  }
  const std::string statuses = ExitCodeHelp();
  const size_t first = statuses.find('\n') + 1;  // after its own heading
  return absl::StrCat(text, Heading("EXIT STATUS"), Footer(statuses.substr(first)));
}

void AddManualCommand(CLI::App* app, int* exit_code) {
  CLI::App* command = app->add_subcommand("manual", "Print the manual page, for man -l");
  command->footer("Example:\n  amhex manual > amhex.1");
  command->callback([app, exit_code] {
    std::fputs(ManualPage(*app).c_str(), stdout);
    *exit_code = kExitSuccess;
  });
}

}  // namespace amhex::client
