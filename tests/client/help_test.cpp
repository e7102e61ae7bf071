#include "cli/help.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/str_split.h"
#include "cli/commands.h"

namespace amhex::client {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class CommandLine : public ::testing::Test {
 protected:
  CommandLine() {
    app_.set_version_flag("--version", "amhex 1");
    AddAllCommands(&app_, &exit_code_);
  }

  std::vector<const CLI::App*> Commands() const {
    return std::as_const(app_).get_subcommands([](const CLI::App*) { return true; });
  }

  // What stderr says of a line that cannot be parsed; no line here starts a command.
  std::string ErrorOf(const std::string& line) {
    try {
      app_.parse(line);
    } catch (const CLI::ParseError& error) {
      return UsageError(app_, error);
    }
    ADD_FAILURE() << line << " was parsed";
    return "";
  }

  CLI::App app_;
  int exit_code_ = 0;
};

TEST_F(CommandLine, NothingAsksForACommand) {
  EXPECT_THAT(ErrorOf(""), HasSubstr("a command is missing"));
}

TEST_F(CommandLine, MistypedCommandsAreGuessed) {
  EXPECT_THAT(ErrorOf("meash part.stl"), HasSubstr("no such command: meash; did you mean mesh?"));
  EXPECT_THAT(ErrorOf("rendre part.vtu"), HasSubstr("did you mean render?"));
  EXPECT_THAT(ErrorOf("frobnicate"), Not(HasSubstr("did you mean")));
}

TEST_F(CommandLine, MistypedFlagsAreGuessedBeforeWhatIsMissing) {
  EXPECT_THAT(ErrorOf("mesh part.stl --ouput part.vtu"),
              HasSubstr("no such flag: --ouput; did you mean --output?"));
  EXPECT_THAT(ErrorOf("mesh part.stl -o part.vtu --cell=5"),
              HasSubstr("no such flag: --cell; did you mean --cells?"));
  EXPECT_THAT(ErrorOf("--versoin"), HasSubstr("did you mean --version?"));
}

TEST_F(CommandLine, AWordTooManyIsNamedWithWhatIsMissing) {
  EXPECT_THAT(ErrorOf("mesh part.stl part.vtu"),
              HasSubstr("--output is required; one word too many: part.vtu"));
  EXPECT_THAT(ErrorOf("mesh part.stl more -o part.vtu"), HasSubstr("one word too many: more"));
}

TEST_F(CommandLine, ErrorsPointToTheHelpOfTheirCommand) {
  EXPECT_THAT(ErrorOf("mesh"), HasSubstr("amhex mesh --help"));
  EXPECT_THAT(ErrorOf("list"), HasSubstr("AMHEX_SERVER"));
}

TEST_F(CommandLine, LimitsAreNamedWithTheValue) {
  const std::string mesh = "mesh part.stl -o part.vtu ";
  EXPECT_THAT(ErrorOf(mesh + "--cells -5"), HasSubstr("must be a number above 0, got -5"));
  EXPECT_THAT(ErrorOf(mesh + "--cells 0"), HasSubstr("got 0"));
  EXPECT_THAT(ErrorOf(mesh + "--cells many"), HasSubstr("got many"));
  EXPECT_THAT(ErrorOf(mesh + "--cells nan"), HasSubstr("got nan"));
  EXPECT_THAT(ErrorOf(mesh + "--priority 101"), HasSubstr("in [0, 100], got 101"));
}

TEST_F(CommandLine, EveryCommandHasAnExampleOfItself) {
  for (const CLI::App* command : Commands()) {
    EXPECT_THAT(command->get_footer(), StartsWith("Example"));
    EXPECT_THAT(command->get_footer(), HasSubstr("amhex " + command->get_name()));
  }
}

TEST_F(CommandLine, HelpFitsATerminalButForExamples) {
  for (const CLI::App* command : Commands()) {
    const std::string help = command->help();
    for (absl::string_view line : absl::StrSplit(help.substr(0, help.find("Example")), '\n')) {
      EXPECT_LE(line.size(), 80u) << command->get_name() << ": " << line;
    }
  }
}

TEST_F(CommandLine, HelpShowsDefaults) {
  const std::string help = app_.get_subcommand("mesh")->help();
  EXPECT_THAT(help, HasSubstr("--jitter X=0.2"));
  EXPECT_THAT(help, HasSubstr("--sharp-angle DEGREES=35"));
  EXPECT_THAT(help, HasSubstr("--extraction {direct,paper}=direct"));
}

TEST_F(CommandLine, TheManualPageHoldsEveryCommandAndFlag) {
  std::string page = ManualPage(app_);
  page.erase(std::remove(page.begin(), page.end(), '\\'), page.end());
  for (const CLI::App* command : Commands()) {
    EXPECT_TRUE(absl::StrContains(page, ".SH amhex " + command->get_name() + "\n"));
    for (const CLI::Option* option : command->get_options()) {
      // What every command has is not said again and again.
      if (option == command->get_help_ptr()) continue;
      for (const std::string& name : option->get_lnames()) {
        EXPECT_TRUE(absl::StrContains(page, "--" + name)) << name;
      }
    }
  }
}

TEST_F(CommandLine, NoTextOfTheManualPageIsARequest) {
  const std::set<std::string> requests = {".TH", ".SH", ".PP", ".TP", ".B", ".I", ".nf", ".fi"};
  for (absl::string_view line : absl::StrSplit(ManualPage(app_), '\n')) {
    const std::string text(line);
    EXPECT_THAT(text, Not(StartsWith("'")));
    if (text.substr(0, 1) == ".") {
      EXPECT_TRUE(requests.count(text.substr(0, text.find(' ')))) << text;
    }
  }
}

TEST(NearestWord, IsNearOrNothing) {
  EXPECT_EQ(NearestWord("", {"mesh"}), "");
  EXPECT_EQ(NearestWord("mesh", {}), "");
  EXPECT_EQ(NearestWord("mesh", {"list", "mesh"}), "mesh");
  EXPECT_EQ(NearestWord("mseh", {"list", "mesh"}), "");
  EXPECT_EQ(NearestWord("cancle", {"cancel", "convert"}), "cancel");
  EXPECT_EQ(NearestWord("--tls-c", {"--tls", "--tls-ca"}), "--tls-ca");
}

TEST(Wrapped, BreaksBetweenWordsOnly) {
  EXPECT_EQ(Wrapped("", 10), "");
  EXPECT_EQ(Wrapped("a bc def", 4), "a bc\ndef");
  EXPECT_EQ(Wrapped("longer than it may be", 3), "longer\nthan\nit\nmay\nbe");
}

}  // namespace
}  // namespace amhex::client
