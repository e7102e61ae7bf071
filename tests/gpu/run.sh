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
loader=("$here"/lib/ld-linux-*)
program() {  # NAME ARGUMENT...
  local name=$1
  shift
  "${loader[0]}" --library-path "$here/lib" "$here/bin/$name" "$@"
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

names_of_tests() {
  program engine_tests --gtest_list_tests --gtest_filter="$tested" |
    awk '/^[^ ].*\.( |$)/ { suite = $1 } /^ / { print suite $1 }'
}

# One test in a process of its own: after a kernel that fails a process cannot use the device.
run_test() {  # NAME LOG
  local status=0
  timeout "$longest_test" "${loader[0]}" --library-path "$here/lib" "$here/bin/engine_tests" \
    --gtest_filter="$1" >"$2" 2>&1 || status=$?
  if ((status == 0)) && grep -q 'SKIPPED' "$2"; then
    echo "skipped, so the device was not checked" >>"$2"
    status=1
  fi
  return "$status"
}

# A test that fails runs again, the host waiting for each kernel, so that the message names the one
# that failed.
run_tests() {
  local names name log failed=() count=0
  log=$(mktemp)
  names=$(names_of_tests)
  [[ -n $names ]] || { echo "run: no tests were found" >&2; return 1; }
  for name in $names; do
    count=$((count + 1))
    if run_test "$name" "$log"; then
      echo "ok      $name"
    else
      failed+=("$name")
      echo "FAILED  $name"
      tail -n 20 "$log"
      echo "again with CUDA_LAUNCH_BLOCKING=1:"
      CUDA_LAUNCH_BLOCKING=1 run_test "$name" "$log" && echo "no failure this time"
      tail -n 20 "$log"
    fi
  done
  echo "$count tests, ${#failed[@]} of them failed${failed[*]:+: ${failed[*]}}"
  ((${#failed[@]} == 0))
}
run_benchmarks() {
  nvidia-smi --query-gpu=name,driver_version,memory.total --format=csv,noheader || true
  program engine_benchmarks --benchmark_filter=OnDevice
}

sanitize() {  # TOOL...
  local tool
  for tool in "$@"; do
    echo "compute-sanitizer --tool $tool"
    compute-sanitizer --tool "$tool" --error-exitcode 1 \
      "${loader[0]}" --library-path "$here/lib" "$here/bin/engine_tests" \
      --gtest_filter="$sanitized_tests"
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
