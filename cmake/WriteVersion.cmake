# Run by the target amhex_version_header; see Version.cmake.
if(NOT REVISION)
  execute_process(COMMAND git describe --always --dirty --abbrev=12 --exclude=*
    WORKING_DIRECTORY ${SOURCE} OUTPUT_VARIABLE REVISION OUTPUT_STRIP_TRAILING_WHITESPACE
    ERROR_QUIET RESULT_VARIABLE failed)
  if(failed)
    # Results are shared between builds of one name, so each state of the sources needs its own.
    file(GLOB_RECURSE sources RELATIVE ${SOURCE}
      ${SOURCE}/engine/* ${SOURCE}/server/* ${SOURCE}/proto/* ${SOURCE}/cmake/*)
    list(SORT sources)
    set(digests "")
    foreach(source IN LISTS sources)
      file(SHA256 ${SOURCE}/${source} digest)
      string(APPEND digests "${source} ${digest}\n")
    endforeach()
    string(SHA256 digest "${digests}")
    string(SUBSTRING ${digest} 0 12 digest)
    set(REVISION "unknown commit, sources ${digest}")
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
