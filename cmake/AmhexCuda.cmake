# Decides whether the CUDA backend is built, and how. AUTO builds it where nvcc is found.
#
# The backend is a shared library that the engine loads when it is first asked for: one build of
# everything else runs with and without a device.
set(AMHEX_CUDA_FOUND FALSE)
if(NOT AMHEX_CUDA STREQUAL "OFF")
  # nvcc's own installer leaves it outside the PATH.
  find_program(AMHEX_NVCC nvcc HINTS ENV CUDA_HOME ENV CUDA_PATH PATHS /usr/local/cuda
    PATH_SUFFIXES bin)
  if(AMHEX_NVCC AND NOT CMAKE_CUDA_COMPILER AND NOT DEFINED ENV{CUDACXX})
    set(CMAKE_CUDA_COMPILER ${AMHEX_NVCC})
  endif()
  # Turing to Hopper as machine code, and PTX from which later drivers compile for later devices.
  # -DCMAKE_CUDA_ARCHITECTURES=90 builds for one, which saves a minute while developing.
  if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES)
    set(CMAKE_CUDA_ARCHITECTURES 75-real 80-real 86-real 89-real 90)
  endif()
  include(CheckLanguage)
  check_language(CUDA)
  if(CMAKE_CUDA_COMPILER)
    set(AMHEX_CUDA_FOUND TRUE)
    enable_language(CUDA)
    # CMake 3.25 does not know that nvcc speaks C++20 when its host compiler is found by default.
    if(NOT CMAKE_CUDA20_STANDARD_COMPILE_OPTION)
      set(CMAKE_CUDA20_STANDARD_COMPILE_OPTION "-std=c++20")
      set(CMAKE_CUDA20_EXTENSION_COMPILE_OPTION "-std=c++20")
    endif()
  elseif(AMHEX_CUDA STREQUAL "ON")
    message(FATAL_ERROR "AMHEX_CUDA=ON but no CUDA compiler was found; set CUDACXX or use AUTO")
  endif()
endif()

# Adds the engine's CUDA library. Call from the engine's folder.
function(amhex_add_cuda_engine)
  # Host code that both libraries need is compiled into both.
  add_library(amhex_engine_cuda SHARED
    src/cuda/engine_cuda.cu src/relax/regularity_weight.cpp
    src/relax/label_groups.cpp)
  add_library(amhex::engine_cuda ALIAS amhex_engine_cuda)
  target_include_directories(amhex_engine_cuda PRIVATE include src)
  target_link_libraries(amhex_engine_cuda PRIVATE Eigen3::Eigen)
  # fmad off for the same reason as -ffp-contract=off: CPU and CUDA round alike.
  target_compile_options(amhex_engine_cuda PRIVATE
    $<$<COMPILE_LANGUAGE:CUDA>:--fmad=false --expt-relaxed-constexpr -Werror=all-warnings
      -Xcompiler=-ffp-contract=off,-Wall,-Wextra,-Werror,-fvisibility=hidden>
    $<$<COMPILE_LANGUAGE:CXX>:-fvisibility=hidden>)
  set_target_properties(amhex_engine_cuda PROPERTIES CUDA_RUNTIME_LIBRARY Static)
endfunction()
