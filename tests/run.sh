#!/usr/bin/env bash
# Installs what is missing, builds everything and runs every test; on a bare Debian 12 too.
#
#   tests/run.sh                     release build, all tests
#   tests/run.sh --filter REGEX      only the tests whose names match
#   tests/run.sh --sanitize          with the address and undefined-behaviour sanitizers
#   tests/run.sh --sanitize=thread   with the thread sanitizer
#   tests/run.sh --races             queue, watching and supervision of workers alone, under the thread sanitizer
#   tests/run.sh --fuzz SECONDS      besides the tests, fuzzes each target for so long (tests/fuzz/run.sh)
#   tests/run.sh --images            the container images, really built and run (deploy/test-images.sh);
#                                    that for GPUs where there is nvcc ($CUDA_HOME, else /usr/local/cuda)
#   tests/run.sh --tidy              clang-tidy over every source file, no tests
#   tests/run.sh --all-packages      installs, too, what the tests with other people's software need (300 MB)
#
# IMAGES_FOLDER=FOLDER keeps what --images makes for the next time.
# The last line is the summary; the exit status is 0 only if everything passed.
set -euo pipefail

cd "$(dirname "$(readlink -f "$0")")/.."

preset=release
filter=
fuzz_seconds=
races=false
tidy=false
images=false
all_packages=false
while [[ $# -gt 0 ]]; do
  case "$1" in
    --sanitize|--sanitize=address) preset=asan ;;
    --sanitize=thread) preset=tsan ;;
    --races) preset=tsan; races=true ;;
    --fuzz) fuzz_seconds="${2:?--fuzz needs seconds}"; shift ;;
    --tidy) tidy=true ;;
    --images) images=true ;;
    --all-packages) all_packages=true ;;
    --filter) filter="${2:?--filter needs a regular expression}"; shift ;;
    --filter=*) filter="${1#--filter=}" ;;
    -h|--help) sed -n '2,16s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) echo "tests/run.sh: unknown option $1; see --help" >&2; exit 2 ;;
  esac
  shift
done

started=$SECONDS
say() { printf '\n== %s  [%d s]\n' "$*" "$((SECONDS - started))"; }
on_exit() {
  local status=$?
  if [[ $status -ne 0 ]]; then
    printf '\ntests/run.sh: FAILED (%s, exit status %d, %d s)\n' "$step" "$status" \
      "$((SECONDS - started))" >&2
  fi
}
trap on_exit EXIT

if $images; then
  step="building and running images"
  # One folder, so that both share the base and what the compiler has done.
  folder=${IMAGES_FOLDER:-$(mktemp -d)}
  for options in "" "--cuda ${CUDA_HOME:-/usr/local/cuda}"; do
    # shellcheck disable=SC2086  # options of several words
    deploy/test-images.sh --keep "$folder" $options
  done
  if [[ -z ${IMAGES_FOLDER:-} ]]; then rm -rf "$folder"; fi
  printf '\ntests/run.sh: PASSED (images, %d s)\n' "$((SECONDS - started))"
  exit 0
fi

step="installing packages"
say "Packages"
sections=(build test format)
if $tidy; then sections+=(tidy); fi
if [[ $preset == tsan ]] && ! $races; then sections+=(thread-sanitizer); fi
if [[ -n $fuzz_seconds ]]; then sections+=(fuzz); fi
if $all_packages; then sections+=(readers shells python solvers browser); fi
deploy/install-packages.sh "${sections[@]}"

# One compiler needs up to 1.5 GiB for the generated gRPC code.
memory_gib=$(awk '/MemTotal/ { print int($2 / 1048576) }' /proc/meminfo)
jobs=$(nproc)
most_jobs=$((memory_gib * 2 / 3))
if ((jobs > most_jobs)); then jobs=$((most_jobs > 0 ? most_jobs : 1)); fi

configure=(-DAMHEX_TESTS=ON)
if command -v ccache >/dev/null; then configure+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi

if $tidy; then
  step="clang-tidy"
  say "Configure (tidy)"
  cmake --preset tidy "${configure[@]}" -DCMAKE_CXX_COMPILER_LAUNCHER=
  say "Build through clang-tidy with $jobs jobs"
  cmake --build --preset tidy -j "$jobs"
  printf '\ntests/run.sh: PASSED (clang-tidy, %d s)\n' "$((SECONDS - started))"
  exit 0
fi

step="configuring"
say "Configure ($preset)"
cmake --preset "$preset" "${configure[@]}"

# Sanitizers of this age do not start where the kernel spreads addresses over more than 28 bits.
steady=()
if [[ $preset != release ]] && setarch "$(uname -m)" --addr-no-randomize true 2>/dev/null; then
  steady=(setarch "$(uname -m)" --addr-no-randomize)
fi

if $races; then
  step="looking for races"
  say "Build and run the tests of queue, watching and supervision with $jobs jobs"
  cmake --build --preset "$preset" -j "$jobs" --target queue_tests
  "${steady[@]}" "build/$preset/tests/service/queue_tests" --gtest_brief=1
  printf '\ntests/run.sh: PASSED (no races, %d s)\n' "$((SECONDS - started))"
  exit 0
fi

step="building"
say "Build with $jobs jobs"
cmake --build --preset "$preset" -j "$jobs"

if [[ $preset == tsan ]]; then
  step="building oneTBB for the thread sanitizer"
  say "oneTBB for the thread sanitizer"
  LD_LIBRARY_PATH="$(tests/instrumented_tbb.sh build/tsan-tbb)${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
  export LD_LIBRARY_PATH
fi

step="testing"
say "Tests"
select=()
if [[ -n $filter ]]; then select=(-R "$filter"); fi
results="build/$preset/test_results.txt"
"${steady[@]}" ctest --preset "$preset" -j "$jobs" "${select[@]}" | tee "$results"

if [[ -n $fuzz_seconds ]]; then
  step="fuzzing"
  say "Fuzz each target for $fuzz_seconds s"
  tests/fuzz/run.sh "$fuzz_seconds"
fi

summary=$(grep -E '^[0-9]+% tests passed' "$results" || true)
printf '\ntests/run.sh: PASSED (%s, %d s)\n' "$summary" "$((SECONDS - started))"
