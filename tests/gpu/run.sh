#!/usr/bin/env bash
# Checks and measures the CUDA engine on this machine; packed by tests/gpu/pack.sh.
#
#   run                       tests, sanitizers where compute-sanitizer is installed, benchmarks
#   run --tests               tests only
#   run --benchmarks          benchmarks only
#   run --sanitize [TOOL]     parity tests under compute-sanitizer: memcheck, racecheck, initcheck
#
# Ends with status 0 only if every test passed and none was skipped for want of a device.
set -euo pipefail

here=$(dirname "$(readlink -f "$0")")
export AMHEX_CUDA_LIBRARY=$here/lib/libamhex_engine_cuda.so

# What starts a program: nothing where the machine's own C library will do, else the loader that
# was packed with ours. Drivers may lie where only LD_LIBRARY_PATH leads.
others=${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
start=(env "LD_LIBRARY_PATH=$here/lib$others")
if ! "${start[@]}" "$here/bin/engine_tests" --gtest_list_tests >/dev/null 2>&1; then
  loader=("$here"/c_library/ld-linux-*)
  start=("${loader[0]}" --library-path "$here/lib:$here/c_library$others")
fi
program() {  # NAME ARGUMENT...
  local name=$1
  shift
  "${start[@]}" "$here/bin/$name" "$@"
}

device_tests='*CudaParity*:*Backends*'
# What it looks at is a machine without the library.
other_tests='Backends.TheLoadersWords*'
# Slow under a sanitizer: one of every kind.
sanitized_tests='*CudaParity*OneIteration:*CudaParity*PaperLattice:*CudaParityOfFields*'
sanitized_tests+=':*CudaParityOfHullQueries*:*CudaParityOfMatching*:*CudaParityOfPlacement.Moves*'
sanitized_tests+=':*CudaParityOfSampling*:*CudaParityOfTheHierarchy*:*CudaParityOfMeasures*:*CudaParityOfTopology*'
tools=(memcheck racecheck initcheck)
tested="$device_tests:*LabelKernel*:Relaxation*:*SplitSites*-$other_tests"
longest_test=600  # seconds; the slowest takes some ten on a CPU
at_once=$(($(nproc) > 8 ? 8 : $(nproc)))

names_of_tests() {
  program engine_tests --gtest_list_tests --gtest_filter="$tested" |
    awk '/^[^ ].*\.( |$)/ { suite = $1 } /^ / { print suite $1 }'
}

# One test in a process of its own: after a kernel that fails a process cannot use the device.
run_test() {  # NAME LOG
  local status=0
  timeout "$longest_test" "${start[@]}" "$here/bin/engine_tests" \
    --gtest_filter="$1" >"$2" 2>&1 || status=$?
  if ((status == 0)) && grep -q 'SKIPPED' "$2"; then
    echo "skipped, so the device was not checked" >>"$2"
    status=1
  fi
  return "$status"
}

# A test that fails runs again, the host waiting for each kernel, so that the message names the one
# that failed.
report_test() {  # NAME
  local log
  log=$(mktemp)
  if run_test "$1" "$log"; then
    echo "ok      $1"
  else
    echo "FAILED  $1"
    tail -n 20 "$log"
    echo "again with CUDA_LAUNCH_BLOCKING=1:"
    CUDA_LAUNCH_BLOCKING=1 run_test "$1" "$log" && echo "no failure this time"
    tail -n 20 "$log"
  fi
  rm -f "$log"
}

run_tests() {
  local names reports failed name count=0
  reports=$(mktemp)
  names=$(names_of_tests)
  [[ -n $names ]] || { echo "run: no tests were found" >&2; return 1; }
  for name in $names; do
    while (($(jobs -rp | wc -l) >= at_once)); do wait -n; done
    printf '%s\n' "$(report_test "$name")" | tee -a "$reports" &
    count=$((count + 1))
  done
  wait
  failed=$(sed -n 's/^FAILED  //p' "$reports" | tr '\n' ' ')
  local passed
  passed=$(grep -c '^ok  ' "$reports") || true
  rm -f "$reports"
  echo "$count tests, $passed of them passed${failed:+, failed: $failed}"
  ((passed == count))
}

run_benchmarks() {
  nvidia-smi --query-gpu=name,driver_version,memory.total --format=csv,noheader || true
  program engine_benchmarks --benchmark_filter=OnDevice
}

sanitize() {  # TOOL...
  local tool
  for tool in "$@"; do
    echo "compute-sanitizer --tool $tool"
    compute-sanitizer --target-processes all --tool "$tool" --error-exitcode 1 \
      "${start[@]}" "$here/bin/engine_tests" --gtest_filter="$sanitized_tests"
  done
}

case "${1:-}" in
  --tests) run_tests ;;
  --benchmarks) run_benchmarks ;;
  --sanitize)
    if [[ $# -gt 1 ]]; then sanitize "$2"; else sanitize "${tools[@]}"; fi
    ;;
  '')
    run_tests
    if command -v compute-sanitizer >/dev/null; then
      sanitize "${tools[@]}"
    else
      echo "run: compute-sanitizer is not installed: nothing was sanitized" >&2
    fi
    run_benchmarks
    ;;
  *) sed -n '2,9s/^# \{0,1\}//p' "$0"; exit 2 ;;
esac
