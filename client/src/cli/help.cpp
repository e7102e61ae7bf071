#include "cli/help.h"

#include <algorithm>
#include <numeric>
#include <sstream>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace amhex::client {
namespace {

constexpr size_t kLineWidth = 80;   // of a terminal that nobody has made wider
constexpr size_t kNameColumn = 30;  // of it before the description

CLI::Validator NumberThat(const std::string& demand, bool (*holds)(double, double, double),
                          double low, double high) {
  const auto check = [demand, holds, low, high](const std::string& text) -> std::string {
    double value = 0;
    if (absl::SimpleAtod(text, &value) && holds(value, low, high)) return "";
    return absl::StrCat("must be a number ", demand, ", got ", text);
  };
  return CLI::Validator(check, "");
}

// Letters to leave out, put in or change to make one word of the other (Levenshtein's distance).
size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 0; i < a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i + 1;
    for (size_t j = 0; j < b.size(); ++j) {
      const size_t changed = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

std::vector<std::string> CommandNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(command->get_name());
    for (const std::string& alias : command->get_aliases()) names.push_back(alias);
  }
  return names;
}

std::vector<std::string> FlagNames(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

std::string DidYouMean(const std::string& nearest) {
  return nearest.empty() ? "" : absl::StrCat("; did you mean ", nearest, "?");
}

bool IsFlag(const std::string& word) { return absl::StartsWith(word, "-"); }

// What the words that were not understood tell.
std::string Unexpected(const CLI::App& command, const std::vector<std::string>& words) {
  const auto flag = std::find_if(words.begin(), words.end(), IsFlag);
  if (flag == words.end()) return absl::StrCat("one word too many: ", words.front());
  const std::string name = flag->substr(0, flag->find('='));
  return absl::StrCat("no such flag: ", name, DidYouMean(NearestWord(name, FlagNames(command))));
}

}  // namespace

CLI::Validator AboveZero() {
  return NumberThat(
      "above 0", [](double value, double, double) { return value > 0; }, 0, 0);
}

CLI::Validator Within(double low, double high) {
  return NumberThat(
      absl::StrCat("in [", low, ", ", high, "]"),
      [](double value, double least, double most) { return value >= least && value <= most; }, low,
      high);
}

HelpFormatter::HelpFormatter() { column_width(kNameColumn); }

std::string HelpFormatter::make_group(std::string group, bool is_positional,
                                      std::vector<const CLI::Option*> options) const {
  const std::string text = CLI::Formatter::make_group(group, is_positional, std::move(options));
  // Between groups CLI11 leaves two lines free.
  const bool is_first = is_positional || group == "Options";
  return is_first || text.empty() ? text : text.substr(1);
}

std::string HelpFormatter::make_option_opts(const CLI::Option* option) const {
  std::string text;
  const std::string value = ValueOf(*option), preset = option->get_default_str();
  if (!value.empty()) absl::StrAppend(&text, " ", value, preset.empty() ? "" : "=", preset);
  if (option->get_required()) absl::StrAppend(&text, " (required)");
  if (!option->get_envname().empty()) absl::StrAppend(&text, " ($", option->get_envname(), ")");
  return text;
}

std::string HelpFormatter::make_option_desc(const CLI::Option* option) const {
  return Wrapped(option->get_description(), kLineWidth - kNameColumn);
}

std::string HelpFormatter::make_subcommand(const CLI::App* command) const {
  std::ostringstream out;
  CLI::detail::format_help(out, command->get_display_name(true),
                           Wrapped(command->get_description(), kLineWidth - kNameColumn),
                           kNameColumn);
  return out.str();
}

std::string ValueOf(const CLI::Option& option) {
  if (option.get_expected_min() == 0) return "";
  const std::string name = option.get_type_name();
  return absl::StartsWith(name, ":") ? name.substr(1) : name;
}

std::string Wrapped(std::string_view text, size_t width) {
  std::string wrapped;
  size_t column = 0;
  for (absl::string_view word : absl::StrSplit(absl::string_view(text.data(), text.size()), ' ')) {
    const bool fits = column == 0 || column + 1 + word.size() <= width;
    if (column > 0) wrapped += fits ? ' ' : '\n';
    column = fits && column > 0 ? column + 1 + word.size() : word.size();
    absl::StrAppend(&wrapped, word);
  }
  return wrapped;
}

std::string NearestWord(std::string_view word, const std::vector<std::string>& known) {
  // A typing error or two; in short words one, or any word would be near.
  const size_t most = word.size() < 5 ? 1 : 2;
  std::string nearest;
  size_t least = most + 1;
  for (const std::string& candidate : known) {
    // Of "--cell" and "--cells" the one is the beginning of the other.
    const bool begun = word.size() >= 4 && candidate.starts_with(word);
    const size_t distance = begun ? 1 : EditDistance(word, candidate);
    if (distance >= least) continue;
    least = distance;
    nearest = candidate;
  }
  return nearest;
}

std::string UsageError(const CLI::App& app, const CLI::Error& error) {
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  const CLI::App& command = chosen.empty() ? app : *chosen.front();
  const std::vector<std::string> unexpected = command.remaining();
  std::string what = error.what();
  std::string where = "amhex --help";
  if (!chosen.empty()) {
    where = absl::StrCat("amhex ", command.get_name(), " --help");
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError) ||
        std::any_of(unexpected.begin(), unexpected.end(), IsFlag)) {
      what = Unexpected(command, unexpected);
    } else if (!unexpected.empty()) {
      absl::StrAppend(&what, "; ", Unexpected(command, unexpected));
    } else if (absl::StartsWith(what, "--server is required")) {
      absl::StrAppend(&what, ", or AMHEX_SERVER in the environment: amhexd starts a server");
    }
  } else if (unexpected.empty() || IsFlag(unexpected.front())) {
    what = unexpected.empty() ? "a command is missing" : Unexpected(app, unexpected);
  } else {
    const std::string& word = unexpected.front();
    what =
        absl::StrCat("no such command: ", word, DidYouMean(NearestWord(word, CommandNames(app))));
  }
  return absl::StrCat("amhex: error: ", what, "\namhex: ", where, " tells what there is\n");
}

}  // namespace amhex::client
