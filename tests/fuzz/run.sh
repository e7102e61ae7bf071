#!/usr/bin/env bash
# Fuzzes each target for a while with libFuzzer, the address and the undefined-behaviour sanitizers.
#
#   tests/fuzz/run.sh [SECONDS]      per target, default 60; needs clang-14
#
# What was found is left in build/fuzz/; add it to tests/fuzz/corpus/ once it is understood.
set -euo pipefail

cd "$(dirname "$(readlink -f "$0")")/../.."
seconds=${1:-60}
command -v clang++-14 >/dev/null || { echo "tests/fuzz/run.sh: clang++-14 is not installed" >&2; exit 2; }
cmake -S . -B build/fuzz -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DAMHEX_CUDA=OFF -DAMHEX_TESTS=ON \
  -DAMHEX_FUZZ=ON -DCMAKE_C_COMPILER=clang-14 -DCMAKE_CXX_COMPILER=clang++-14
targets=(preflight request decode check_input small_soup)
cmake --build build/fuzz --target "${targets[@]/#/fuzz_}"
for target in "${targets[@]}"; do
  mkdir -p "build/fuzz/corpus_$target"
  # The decoder may take the memory that its limits permit, a small soup its seconds with all checks
  # on; libFuzzer's bounds catch the rest.
  "build/fuzz/tests/fuzz/fuzz_$target" -max_total_time="$seconds" -timeout=60 -rss_limit_mb=2048 \
    -artifact_prefix="build/fuzz/$target-" -print_final_stats=1 \
    "build/fuzz/corpus_$target" "tests/fuzz/corpus/$target"
done
