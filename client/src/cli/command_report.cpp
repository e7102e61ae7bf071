// amhex report: a mesh file as a page for the browser.
#include <cstdio>
#include <filesystem>
#include <memory>

#include "absl/strings/str_cat.h"
#include "cli/commands.h"
#include "cli/exit_codes.h"
#include "cli/shared_flags.h"
#include "formats/hull_writer.h"
#include "formats/mesh_file.h"
#include "page/report_page.h"

namespace amhex::client {
namespace {

struct ReportFlags {
  std::string mesh, output, title, input;
};

int RunReport(const ReportFlags& flags) {
  absl::StatusOr<MeshDocument> document = ReadMeshFile(flags.mesh);
  if (!document.ok()) return Fail(document.status(), kExitInput);
  const absl::Status measured = MeasureDistances(flags.input, &*document);
  if (!measured.ok()) return Fail(measured, kExitInput);
  const std::string title =
      flags.title.empty() ? std::filesystem::path(flags.mesh).filename().string() : flags.title;
  const absl::StatusOr<std::string> page = FormatReportPage(*document, title);
  if (!page.ok()) return Fail(page.status(), kExitInput);
  const absl::Status status = WriteWholeFile(flags.output, *page);
  if (!status.ok()) return Fail(status, kExitOutput);
  std::printf("%s: %.1f MB, for any browser, needs no network\n", flags.output.c_str(),
              static_cast<double>(page->size()) / 1e6);
  return kExitSuccess;
}

}  // namespace

void AddReportCommand(CLI::App* app, int* exit_code) {
  auto flags = std::make_shared<ReportFlags>();
  CLI::App* command = app->add_subcommand(
      "report", "Write a page for the browser: the mesh in 3-D, histograms, timings, distances");
  command->add_option("mesh", flags->mesh, absl::StrCat("Volume mesh: ", kMeshExtensions))
      ->type_name("FILE")
      ->required();
  command->add_option("-o,--output", flags->output, "HTML file")->type_name("FILE")->required();
  command->add_option("--title", flags->title, "Heading; by default the file's name")
      ->type_name("TEXT");
  command->add_option("--input", flags->input, kInputHelp)->type_name("FILE");
  command->footer(
      "Examples:\n"
      "  amhex report part.vtu -o part.html\n"
      "  amhex report part.vtu -o part.html --input part.stl");
  command->callback([flags, exit_code] { *exit_code = RunReport(*flags); });
}

}  // namespace amhex::client
