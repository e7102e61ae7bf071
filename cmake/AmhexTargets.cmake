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
  add_compile_options(-fsanitize=${AMHEX_SANITIZE} -fno-omit-frame-pointer -g)
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
