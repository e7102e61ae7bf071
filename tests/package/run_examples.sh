#!/usr/bin/env bash
# Both examples against a server: the C++ one built on the installed package, the Python one on stubs.
#
#   tests/package/run_examples.sh cpp|python BUILD_FOLDER AMHEX AMHEXD
#
# Exit status 77 where grpcio is not installed.
set -euo pipefail
source_folder=$(readlink -f "$(dirname "$0")/../..")
kind=$1 build=$2 amhex=$3 amhexd=$4

folder=$(mktemp -d)
server=
on_exit() {
  if [[ -n $server ]]; then kill "$server"; wait "$server" || true; fi
  rm -rf "$folder"
}
trap on_exit EXIT
address="unix:$folder/socket"
"$amhexd" --listen "$address" --data-dir "$folder/data" --metrics-listen "" >"$folder/log" 2>&1 &
server=$!

case $kind in
  cpp)
    for component in client client-dev; do
      cmake --install "$build" --component "$component" --prefix "$folder/installed" >/dev/null
    done
    cmake -S "$source_folder/examples/cpp" -B "$folder/example" -DCMAKE_BUILD_TYPE=Release \
      -DCMAKE_PREFIX_PATH="$folder/installed" >/dev/null
    cmake --build "$folder/example"
    lines=$(wc -l <"$source_folder/examples/cpp/mesh_scan.cpp")
    if ((lines > 30)); then echo "the example has $lines lines"; exit 1; fi
    "$folder/installed/bin/amhex" demo --points 5000 -o "$folder/scan.drc"
    "$folder/example/mesh_scan" "$address" "$folder/scan.drc" | tee "$folder/out"
    ;;
  python)
    if ! /usr/bin/python3 -c "import grpc" 2>/dev/null; then
      echo "skipped: python3-grpcio is not installed"
      exit 77
    fi
    mkdir "$folder/stubs"
    (cd "$source_folder" && protoc -I proto --python_out="$folder/stubs" --grpc_out="$folder/stubs" \
      --plugin=protoc-gen-grpc="$(command -v grpc_python_plugin)" \
      proto/amhex/v1/*.proto proto/google/rpc/*.proto)
    "$amhex" info --server "$address" >/dev/null
    PYTHONPATH="$folder/stubs" /usr/bin/python3 "$source_folder/examples/python/mesh_cloud.py" "$address" |
      tee "$folder/out"
    ;;
esac
grep -Eq "^[1-9][0-9]* cells, [1-9][0-9]* vertices" "$folder/out"
