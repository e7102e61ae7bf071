// How the command line speaks: groups of flags, limits of values, and what to say of a line that
// cannot be understood.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace amhex::client {

// Headings in help texts and in the manual page.
inline constexpr const char* kOutputGroup = "Output";
inline constexpr const char* kSizeGroup = "Size of the cells; by default from the input";
inline constexpr const char* kMeshingGroup = "Meshing";
inline constexpr const char* kRelaxationGroup = "Relaxation and assembly, seldom needed";
inline constexpr const char* kGuidanceGroup = "Guidance, each may be given more than once";
inline constexpr const char* kJobGroup = "The job";
inline constexpr const char* kServerGroup = "Server";
inline constexpr const char* kProgressGroup = "Progress";

// Values that a flag takes; the errors name the value and the limits.
CLI::Validator AboveZero();
CLI::Validator Within(double low, double high);

// Help texts for a terminal of 80 columns, without what the descriptions say anyway.
class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter();
  std::string make_group(std::string group, bool is_positional,
                         std::vector<const CLI::Option*> options) const override;
  std::string make_option_opts(const CLI::Option* option) const override;
  std::string make_option_desc(const CLI::Option* option) const override;
  std::string make_subcommand(const CLI::App* command) const override;
};

// A flag's kind of value as people read it: "FILE", "{auto,cpu,cuda}", or nothing.
std::string ValueOf(const CLI::Option& option);

// `text` in lines of at most `width` characters, where its words allow.
std::string Wrapped(std::string_view text, size_t width);

// The known word that is nearest to `word` by letters left out, put in or changed; empty if none
// is near.
std::string NearestWord(std::string_view word, const std::vector<std::string>& known);

// The lines for stderr when parsing has failed with `error`: what is wrong, and what was meant.
std::string UsageError(const CLI::App& app, const CLI::Error& error);

}  // namespace amhex::client
