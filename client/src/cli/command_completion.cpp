// amhex completion SHELL: what the shell needs to complete command lines, from the parser itself.
#include <cstdio>
#include <memory>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "cli/commands.h"
#include "cli/exit_codes.h"

namespace amhex::client {
namespace {

// "-o --output" for an option with both; nothing for positional ones.
std::vector<std::string> WordsOf(const CLI::Option& option) {
  std::vector<std::string> words;
  for (const std::string& name : option.get_snames()) words.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) words.push_back("--" + name);
  return words;
}

std::vector<const CLI::App*> Commands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

// A command's name and its other names, as in "picture|render" with `between` "|".
std::string NamesOf(const CLI::App& command, const char* between) {
  std::vector<std::string> names = {command.get_name()};
  for (const std::string& alias : command.get_aliases()) names.push_back(alias);
  return absl::StrJoin(names, between);
}

std::string BashScript(const CLI::App& app) {
  std::vector<std::string> names;
  std::string cases;
  for (const CLI::App* command : Commands(app)) {
    names.push_back(NamesOf(*command, " "));
    std::vector<std::string> words;
    for (const CLI::Option* option : command->get_options()) {
      for (const std::string& word : WordsOf(*option)) words.push_back(word);
    }
    absl::StrAppend(&cases, "    ", NamesOf(*command, "|"), ") words=\"", absl::StrJoin(words, " "),
                    "\" ;;\n");
  }
  return absl::StrCat(
      "_amhex() {\n"
      "  local word=${COMP_WORDS[COMP_CWORD]} words=\n"
      "  if [[ $COMP_CWORD -eq 1 ]]; then\n"
      "    COMPREPLY=($(compgen -W \"",
      absl::StrJoin(names, " "),
      " --help --version\" -- \"$word\"))\n"
      "    return\n"
      "  fi\n"
      "  case ${COMP_WORDS[1]} in\n",
      cases,
      "  esac\n"
      "  if [[ $word == -* ]]; then\n"
      "    COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n"
      "  else\n"
      "    COMPREPLY=($(compgen -f -- \"$word\"))\n"
      "  fi\n"
      "}\n"
      "complete -o filenames -F _amhex amhex\n");
}

std::string FishQuoted(const std::string& text) {
  return absl::StrCat("'", absl::StrReplaceAll(text, {{"\\", "\\\\"}, {"'", "\\'"}}), "'");
}

std::string FishScript(const CLI::App& app) {
  std::string script;
  for (const CLI::App* command : Commands(app)) {
    const std::string name = NamesOf(*command, " ");
    absl::StrAppend(&script, "complete -c amhex -n __fish_use_subcommand -f -a '", name, "' -d ",
                    FishQuoted(command->get_description()), "\n");
    for (const CLI::Option* option : command->get_options()) {
      std::string words;
      for (const std::string& s : option->get_snames()) absl::StrAppend(&words, " -s ", s);
      for (const std::string& l : option->get_lnames()) absl::StrAppend(&words, " -l ", l);
      if (words.empty()) continue;
      const bool has_value = option->get_expected_min() > 0;
      absl::StrAppend(&script, "complete -c amhex -n '__fish_seen_subcommand_from ", name, "'",
                      words, has_value ? " -r" : "", " -d ", FishQuoted(option->get_description()),
                      "\n");
    }
  }
  return script;
}

}  // namespace

void AddCompletionCommand(CLI::App* app, int* exit_code) {
  auto shell = std::make_shared<std::string>();
  CLI::App* command =
      app->add_subcommand("completion", "Print what a shell needs to complete command lines");
  command->add_option("shell", *shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}))
      ->type_name("");
  command->footer(
      "Examples:\n"
      "  source <(amhex completion bash)\n"
      "  amhex completion fish > ~/.config/fish/completions/amhex.fish");
  command->callback([app, shell, exit_code] {
    // zsh runs bash's completions.
    const std::string before = *shell == "zsh" ? "autoload -U +X compinit && compinit -u\n"
                                                 "autoload -U +X bashcompinit && bashcompinit\n"
                                               : "";
    const std::string script = *shell == "fish" ? FishScript(*app) : before + BashScript(*app);
    std::fputs(script.c_str(), stdout);
    *exit_code = kExitSuccess;
  });
}

}  // namespace amhex::client
