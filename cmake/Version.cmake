# Target amhex_version: the header build_version.h with the project's version and the commit, kept
# up to date at every build and rewritten only when it changes.
#
# AMHEX_REVISION overrides what git says, for builds from an archive.
set(AMHEX_REVISION "" CACHE STRING "Commit to report instead of asking git")

add_custom_target(amhex_version_header
  COMMAND ${CMAKE_COMMAND}
    -DSOURCE=${PROJECT_SOURCE_DIR} -DVERSION=${PROJECT_VERSION} "-DREVISION=${AMHEX_REVISION}"
    -DOUTPUT=${PROJECT_BINARY_DIR}/version/build_version.h
    -P ${CMAKE_CURRENT_LIST_DIR}/WriteVersion.cmake
  BYPRODUCTS ${PROJECT_BINARY_DIR}/version/build_version.h
  VERBATIM)

add_library(amhex_version INTERFACE)
target_include_directories(amhex_version INTERFACE ${PROJECT_BINARY_DIR}/version)
add_dependencies(amhex_version amhex_version_header)
