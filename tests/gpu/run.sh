#!/usr/bin/env bash
# Checks and measures the CUDA engine on this machine; packed by tests/gpu/pack.sh.
#
#   run                       tests of both backends, then benchmarks on the device
#   run --tests               tests only
#   run --benchmarks          benchmarks only
#   run --sanitize TOOL       parity tests under compute-sanitizer (memcheck, racecheck, initcheck)
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
run_tests() {
  local log
  log=$(mktemp)
  program engine_tests --gtest_filter="$device_tests:*LabelKernel*:Relaxation*:*SplitSites*" |
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

case "${1:-}" in
  --tests) run_tests ;;
  --benchmarks) run_benchmarks ;;
  --sanitize)
    compute-sanitizer --tool "${2:?--sanitize needs a tool}" --error-exitcode 1 \
      "${loader[0]}" --library-path "$here/lib" "$here/bin/engine_tests" \
      --gtest_filter="$device_tests"
    ;;
  '') run_tests && run_benchmarks ;;
  *) sed -n '2,9s/^# \{0,1\}//p' "$0"; exit 2 ;;
esac
