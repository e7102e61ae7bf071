# Compiler settings shared by every target of the project.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

if(AMHEX_SANITIZE)
  # Reports name lines, and nothing more of a debugger's than that is worth the compiler's time.
  add_compile_options(-fsanitize=${AMHEX_SANITIZE} -fno-omit-frame-pointer -g1)
  # What the sanitizers add keeps GCC from seeing that a value is there whenever it is used.
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-Wno-maybe-uninitialized>)
  endif()
  add_link_options(-fsanitize=${AMHEX_SANITIZE})
endif()

# Implicit contraction is off so that CPU and CUDA round alike; where a fused multiply-add pays it
# is written out in the per-element body.
add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-ffp-contract=off>)

function(amhex_warnings target)
  target_compile_options(${target} PRIVATE
    $<$<COMPILE_LANGUAGE:CXX>:-Wall;-Wextra;-Wpedantic;-Wshadow;-Wnon-virtual-dtor;-Wcast-align;-Wunused;-Wunused-const-variable;-Woverloaded-virtual;-Werror>)
endfunction()

# Tests: GoogleTest's macros hold an else of their own, which g++ minds after a plain if.
function(amhex_test_warnings target)
  amhex_warnings(${target})
  target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-Wno-dangling-else>)
endfunction()

# Where the compiler takes longer to optimize than what it makes ever runs, as in tests and in the
# reading of a command line: of five files each took a fifth to a half less to compile.
function(amhex_lightly_optimized target)
  target_compile_options(${target} PRIVATE $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CONFIG:Release>>:-O1>)
endfunction()
function(amhex_lightly_optimized_sources)
  set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS $<$<CONFIG:Release>:-O1>)
endfunction()

# A third of what a compiler does here is reading the same headers of other people again for every
# file, so each larger target reads its own once. A compiler cache does better without, and
# clang-tidy reads every file as it is: both also tell where a file does not include what it uses.
if(CMAKE_CXX_COMPILER_LAUNCHER OR CMAKE_CXX_CLANG_TIDY)
  set(precompile OFF)
else()
  set(precompile ON)
endif()
option(AMHEX_PRECOMPILE "Precompile the headers that most files of a target include" ${precompile})

# Headers of other people only: nobody's work on the project makes them anew. Those of gRPC, CLI11
# and gmock have so many inline functions that every file would be compiled with that it takes
# longer than to read them. Of what it has read like that g++ 12 forgets that it is a system's, and
# minds the standard library's own copying.
function(amhex_precompile target)
  if(AMHEX_PRECOMPILE)
    target_precompile_headers(${target} PRIVATE ${ARGN})
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      target_compile_options(${target} PRIVATE
        $<$<COMPILE_LANGUAGE:CXX>:-Wno-array-bounds;-Wno-restrict;-Wno-stringop-overflow;-Wno-stringop-overread>)
    endif()
  endif()
endfunction()
set(AMHEX_COMMON_HEADERS
  <algorithm> <array> <cmath> <cstdint> <functional> <map> <memory> <numeric> <optional> <string> <string_view>
  <utility> <vector> <absl/status/statusor.h> <absl/strings/str_cat.h>)
set(AMHEX_ENGINE_HEADERS ${AMHEX_COMMON_HEADERS} <tbb/parallel_for.h>)
set(AMHEX_SERVICE_HEADERS
  ${AMHEX_COMMON_HEADERS} <chrono> <condition_variable> <filesystem> <fstream> <mutex> <thread>
  <google/protobuf/message.h>)

# Files of a folder are compiled a few at a time as one: what they include is read once, and what
# they make of its templates is made once. Engine and engine's tests took two cores 383 s instead of
# more than 595. Those whose names begin alike go together, so that a new file changes one group
# alone. Within a group, names in unnamed namespaces must differ; the compiler tells. clang-tidy reads
# every file by itself, and so does clang, which minds a local name that such a namespace has, too.
if(CMAKE_CXX_CLANG_TIDY OR CMAKE_CXX_COMPILER_ID MATCHES "Clang")
  set(unite OFF)
else()
  set(unite ON)
endif()
option(AMHEX_UNITE "Compile files of a folder together" ${unite})

function(amhex_unite target)
  if(NOT AMHEX_UNITE)
    return()
  endif()
  get_target_property(sources ${target} SOURCES)
  foreach(source ${sources})
    cmake_path(ABSOLUTE_PATH source OUTPUT_VARIABLE path)
    cmake_path(RELATIVE_PATH path)
    cmake_path(GET path PARENT_PATH folder)
    cmake_path(GET path FILENAME name)
    string(MAKE_C_IDENTIFIER "${folder}" group)
    foreach(letters a-d e-l m-p q-z)
      if(name MATCHES "^[${letters}]")
        set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${group}_${letters})
      endif()
    endforeach()
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()
