#!/usr/bin/env bash
# Fuzzes each target for a while with libFuzzer, the address and the undefined-behaviour sanitizers,
# as many at a time as there are cores.
#
#   tests/fuzz/run.sh [SECONDS]      per target, default 60; needs clang-14
#
# What was found is left in build/fuzz/; add it to tests/fuzz/corpus/ once it is understood.
set -euo pipefail

cd "$(dirname "$(readlink -f "$0")")/../.."
seconds=${1:-60}
command -v clang++-14 >/dev/null || { echo "tests/fuzz/run.sh: clang++-14 is not installed" >&2; exit 2; }
configure=()
if command -v ccache >/dev/null; then configure+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
cmake -S . -B build/fuzz -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DAMHEX_CUDA=OFF -DAMHEX_TESTS=ON \
  -DAMHEX_FUZZ=ON -DCMAKE_C_COMPILER=clang-14 -DCMAKE_CXX_COMPILER=clang++-14 "${configure[@]}"
targets=(small_soup check_input decode upload request preflight)
cmake --build build/fuzz --target "${targets[@]/#/fuzz_}"

# With the seed fixed and the runs bounded, a faster machine does not look farther than a slower one
# in the same minute. Longer runs than a minute are for those who look for something.
most_runs=-1
if ((seconds <= 60)); then most_runs=1000000; fi

# A finding is to be a fault of the program, not of a slow machine: the decoder may take the memory
# that its limits permit, a small soup its seconds with all checks on, several times over where the
# machine has other work. The seed is fixed, so that a run can be repeated.
#
# Leaks are looked for at the end, not after every run: where a run keeps memory for the next one,
# as TBB does, libFuzzer repeats every input to be sure. Longer inputs hold no larger soup, and
# weighing what is rare among a hundred thousand features takes as long as meshing one.
fuzz() {
  local more=()
  if [[ $1 == small_soup ]]; then more=(-detect_leaks=0 -max_len=256 -entropic=0); fi
  mkdir -p "build/fuzz/corpus_$1"
  if "build/fuzz/tests/fuzz/fuzz_$1" -seed=1 -runs="$most_runs" -max_total_time="$seconds" -timeout=300 \
    -rss_limit_mb=3072 "${more[@]}" -artifact_prefix="build/fuzz/$1-" -print_final_stats=1 \
    "build/fuzz/corpus_$1" "tests/fuzz/corpus/$1" >"build/fuzz/$1.log" 2>&1; then
    echo "$1: nothing found in $(sed -n 's/^stat::number_of_executed_units: *//p' "build/fuzz/$1.log") runs"
  else
    echo "$1: FOUND"
    tail -n 60 "build/fuzz/$1.log"
    return 1
  fi
}
export -f fuzz
export seconds most_runs
printf '%s\n' "${targets[@]}" | xargs -P "$(nproc)" -I '{}' bash -c 'fuzz {}'
