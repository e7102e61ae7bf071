# Run by the target amhex_version_header; see Version.cmake.
if(NOT REVISION)
  execute_process(COMMAND git describe --always --dirty --abbrev=12 --exclude=*
    WORKING_DIRECTORY ${SOURCE} OUTPUT_VARIABLE REVISION OUTPUT_STRIP_TRAILING_WHITESPACE
    ERROR_QUIET RESULT_VARIABLE failed)
  if(failed)
    set(REVISION "unknown commit")
  endif()
endif()

set(text "// Written by cmake/WriteVersion.cmake.
#pragma once

namespace amhex {
inline constexpr char kVersion[] = \"${VERSION}\";
inline constexpr char kRevision[] = \"${REVISION}\";  // commit, with -dirty for local changes
}  // namespace amhex
")
set(old "")
if(EXISTS ${OUTPUT})
  file(READ ${OUTPUT} old)
endif()
if(NOT old STREQUAL text)
  file(WRITE ${OUTPUT} "${text}")
endif()
