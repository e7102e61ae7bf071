#!/usr/bin/env bash
# The rules of CONTRIBUTING.md that a machine can check, over every source file. Prints each
# offence as FILE[:LINE]: reason; exit status 1 if there is any.
set -euo pipefail

cd "$(dirname "$(readlink -f "$0")")/.."
offences=$(mktemp)
trap 'rm -f "$offences"' EXIT

sources() {  # FOLDER... : the C++ and CUDA files in them
  find "$@" -type f \( -name '*.h' -o -name '*.cpp' -o -name '*.cu' -o -name '*.cuh' \) | sort
}

# forbid REASON PATTERN FILE... : no line may match.
forbid() {
  local reason=$1 pattern=$2
  shift 2
  { grep -nHE -e "$pattern" -- "$@" /dev/null || true; } |
    awk -F: -v reason="$reason" '{ print $1 ":" $2 ": " reason }' >>"$offences"
}

mapfile -t all < <(sources engine server client tests)
mapfile -t engine < <(sources engine)
mapfile -t outside < <(sources server client)
mapfile -t headers < <(printf '%s\n' "${all[@]}" | grep -E '\.(h|cuh)$')

forbid "the engine knows neither gRPC nor protobuf" \
  '^ *#include +[<"](grpc|google/protobuf|[^">]*\.pb\.h)' "${engine[@]}"
forbid "the engine neither logs nor counts; it reports through RunContext" \
  '^ *#include +[<"](spdlog|prometheus)' "${engine[@]}"
forbid "server and client see the engine's public headers only" \
  '^ *#include +"(engine/|[./]*engine/src)' "${outside[@]}"
forbid "unfinished work does not go in" '\b(TODO|FIXME|XXX)\b' "${all[@]}"
forbid "tabs" $'\t' "${all[@]}"

for header in "${headers[@]}"; do
  grep -q '^#pragma once$' "$header" || echo "$header: no #pragma once" >>"$offences"
done

for file in "${all[@]}"; do
  most_lines=400
  [[ $file == tests/* ]] && most_lines=500
  lines=$(wc -l <"$file")
  ((lines <= most_lines)) || echo "$file: $lines lines, at most $most_lines" >>"$offences"
done

# What a script or a run leaves behind is easily committed. An unpacked archive has no list to check.
known='\.ci|\.clang-format|\.clang-tidy|\.dockerignore|\.editorconfig|\.gitattributes|\.gitignore'
known+='|CMakeLists\.txt|CMakePresets\.json|CONTRIBUTING\.md|LICENSE|README\.md'
known+='|client|cmake|deploy|docs|engine|examples|proto|server|tests'
if tracked=$(git ls-files 2>/dev/null); then
  { cut -d/ -f1 <<<"$tracked" | sort -u | grep -vxE "$known" || true; } |
    sed 's/$/: no part of the project at the top level/' >>"$offences"
fi

format=$(command -v clang-format-14 || true)
if [[ -z $format ]]; then
  echo "clang-format-14 is not installed; deploy/install-packages.sh format" >>"$offences"
else
  printf '%s\0' "${all[@]}" | xargs -0 "$format" --dry-run 2>&1 |
    sed -nE 's/^([^ :]+):[0-9:]+: warning: code should be clang-formatted.*/\1: not formatted/p' |
    sort -u >>"$offences"
fi

if [[ -s $offences ]]; then
  cat "$offences"
  exit 1
fi
echo "${#all[@]} source files follow the rules"
