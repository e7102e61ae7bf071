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
run_tests() {
  local log
  log=$(mktemp)
  program engine_tests \
    --gtest_filter="$device_tests:*LabelKernel*:Relaxation*:*SplitSites*-$other_tests" |
    tee "$log"
  if grep -q 'SKIPPED' "$log"; then
    echo "run: tests were skipped, so the device was not checked" >&2
    return 1
  fi
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
