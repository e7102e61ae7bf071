#include "page/page_assets.h"

// The assembler reads each file as it is; CMake names them and has this file compiled anew when
// one changes.
#define AMHEX_EMBED(name, path)                                         \
  asm(".section .rodata\n"                                              \
      ".global amhex_page_" #name "\namhex_page_" #name                 \
      ":\n"                                                             \
      ".incbin \"" path                                                 \
      "\"\n"                                                            \
      ".global amhex_page_" #name "_end\namhex_page_" #name             \
      "_end:\n"                                                         \
      ".byte 0\n.previous\n");                                          \
  extern "C" const char amhex_page_##name[], amhex_page_##name##_end[]; \
  static_assert(true)

AMHEX_EMBED(html, AMHEX_PAGE_FOLDER "/report.html");
AMHEX_EMBED(style, AMHEX_PAGE_FOLDER "/report.css");
AMHEX_EMBED(charts, AMHEX_PAGE_FOLDER "/report_charts.js");
AMHEX_EMBED(faces, AMHEX_PAGE_FOLDER "/shown_faces.js");
AMHEX_EMBED(viewer, AMHEX_PAGE_FOLDER "/report_viewer.js");
AMHEX_EMBED(page, AMHEX_PAGE_FOLDER "/report_page.js");
AMHEX_EMBED(three, AMHEX_THREE_JS);
AMHEX_EMBED(controls, AMHEX_THREE_CONTROLS_JS);

#undef AMHEX_EMBED

namespace amhex::client {
namespace {

std::string_view Between(const char* begin, const char* end) {
  return {begin, static_cast<size_t>(end - begin)};
}

}  // namespace

PageAssets ReportAssets() {
  return {Between(amhex_page_html, amhex_page_html_end),
          Between(amhex_page_style, amhex_page_style_end),
          Between(amhex_page_charts, amhex_page_charts_end),
          Between(amhex_page_faces, amhex_page_faces_end),
          Between(amhex_page_viewer, amhex_page_viewer_end),
          Between(amhex_page_page, amhex_page_page_end),
          Between(amhex_page_three, amhex_page_three_end),
          Between(amhex_page_controls, amhex_page_controls_end)};
}

}  // namespace amhex::client
