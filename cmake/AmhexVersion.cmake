# Tells the engine its version and revision; both are part of result-cache keys.
find_package(Git QUIET)
set(AMHEX_REVISION "unknown revision")
if(GIT_FOUND)
  execute_process(
    COMMAND ${GIT_EXECUTABLE} describe --always --dirty --tags
    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
    OUTPUT_VARIABLE AMHEX_GIT_DESCRIPTION
    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET
    RESULT_VARIABLE AMHEX_GIT_RESULT)
  if(AMHEX_GIT_RESULT EQUAL 0)
    set(AMHEX_REVISION "${AMHEX_GIT_DESCRIPTION}")
  endif()
endif()
