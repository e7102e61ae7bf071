// The files of the report page, inside this program.
#pragma once

#include <string_view>

namespace amhex::client {

struct PageAssets {
  std::string_view html, style, charts, faces, viewer, page;  // of this folder
  std::string_view three, controls;  // three.js and its orbit controls (MIT)
};

PageAssets ReportAssets();

}  // namespace amhex::client
