#!/usr/bin/env bash
# Packs the engine's tests and benchmarks into one archive that runs on a machine with nothing but
# an NVIDIA driver: programs, CUDA library, every shared library they need, and the loader.
#
#   cmake --preset engine-only && cmake --build --preset engine-only
#   tests/gpu/pack.sh build/engine-only amhex_gpu_check.tar.gz
#
# On the other machine: tar xf amhex_gpu_check.tar.gz && amhex_gpu_check/run
set -euo pipefail

if [[ $# -ne 2 ]]; then
  sed -n '2,9s/^# \{0,1\}//p' "$0"
  exit 2
fi
build=$1
archive=$(realpath -m "$2")
here=$(dirname "$(readlink -f "$0")")

programs=("$build/tests/engine_tests" "$build/tests/benchmarks/engine_benchmarks")
cuda_library=$build/engine/libamhex_engine_cuda.so
for file in "${programs[@]}" "$cuda_library"; do
  [[ -e $file ]] || { echo "tests/gpu/pack.sh: $file is not built" >&2; exit 1; }
done

staging=$(mktemp -d)
trap 'rm -rf "$staging"' EXIT
root=$staging/amhex_gpu_check
mkdir -p "$root/bin" "$root/lib" "$root/c_library"
cp "${programs[@]}" "$root/bin"
cp "$cuda_library" "$root/lib"
cp "$here/run.sh" "$root/run"
chmod +x "$root/run"

# The C library only works with its own loader, so both lie apart: a machine whose own is as new
# uses that.
is_of_the_c_library() {  # FILE
  [[ ${1##*/} =~ ^(ld-linux.*|lib(c|m|dl|rt|pthread|resolv)\.so.*)$ ]]
}

# ldd prints "name => path (address)" for libraries and "path (address)" for the loader.
ldd "${programs[@]}" "$cuda_library" |
  sed -nE 's/^[[:space:]]+([^ ]+ => )?(\/[^ ]+) \(0x.*$/\2/p' | sort -u |
  while read -r library; do
    if is_of_the_c_library "$library"; then
      cp -Ln "$library" "$root/c_library"
    else
      cp -Ln "$library" "$root/lib"
    fi
  done

tar -C "$staging" -czf "$archive" amhex_gpu_check
echo "$archive: $(du -h "$archive" | cut -f1)"
