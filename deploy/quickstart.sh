#!/usr/bin/env bash
# From a bare Debian 12 to a volume mesh of a demo scan: installs packages, builds, starts amhexd
# on loopback, sends it a generated scan and shows the progress live.
#
#   deploy/quickstart.sh           leaves the server running, for your own scans
#   deploy/quickstart.sh --stop    stops the server that an earlier run left
#
# Can be repeated: it builds what has changed, restarts its own server and keeps the queue and
# the results. Everything it makes lies in build/quickstart.
#
# Environment: AMHEX_PORT (50051), AMHEX_METRICS_PORT (9464), AMHEX_CELLS (6000).
set -euo pipefail

cd "$(dirname "$(readlink -f "$0")")/.."
folder="$PWD/build/quickstart"
port="${AMHEX_PORT:-50051}"
metrics_port="${AMHEX_METRICS_PORT:-9464}"
cells="${AMHEX_CELLS:-6000}"
server="127.0.0.1:$port"
pid_file="$folder/amhexd.pid"
amhexd="$PWD/build/release/server/amhexd"
amhex="$PWD/build/release/client/amhex"

say() { printf '\n== %s\n' "$*"; }
fail() { printf 'quickstart: %s\n' "$*" >&2; exit 1; }

# Stops the server of an earlier run, and no other process: the id must belong to our binary.
stop_server() {
  [[ -f $pid_file ]] || return 0
  local pid
  pid="$(cat "$pid_file")"
  if [[ "$(readlink "/proc/$pid/exe" 2>/dev/null || true)" == "$amhexd"* ]]; then
    kill -TERM "$pid"
    for _ in $(seq 300); do
      kill -0 "$pid" 2>/dev/null || break
      sleep 0.1
    done
    if kill -0 "$pid" 2>/dev/null; then fail "the server (process $pid) does not stop"; fi
    echo "Stopped the server (process $pid)."
  fi
  rm -f "$pid_file"
}

case "${1:-}" in
  "") ;;
  --stop) stop_server; exit 0 ;;
  *) fail "unknown option $1; the only one is --stop" ;;
esac

say "1/5  Packages"
deploy/install-packages.sh build

say "2/5  Build (the first one takes some minutes)"
configure=()
# A build folder that tests/run.sh has made keeps its tests.
[[ -f build/release/CMakeCache.txt ]] || configure+=(-DAMHEX_TESTS=OFF)
if command -v ccache >/dev/null; then configure+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
cmake --preset release "${configure[@]}" >/dev/null
memory_gib=$(awk '/MemTotal/ { print int($2 / 1048576) }' /proc/meminfo)
jobs=$(nproc)
most_jobs=$((memory_gib * 2 / 3))
if ((jobs > most_jobs)); then jobs=$((most_jobs > 0 ? most_jobs : 1)); fi
cmake --build --preset release -j "$jobs" --target amhexd amhex-worker amhex

say "3/5  Server on $server"
mkdir -p "$folder"
stop_server
nohup "$amhexd" --listen "$server" --data-dir "$folder/data" \
  --metrics-listen "127.0.0.1:$metrics_port" >"$folder/amhexd.log" 2>&1 </dev/null &
echo $! >"$pid_file"
# Up once it answers and its worker has said which engine it is.
for _ in $(seq 150); do
  "$amhex" info --server "$server" --patience 1 >"$folder/info.txt" 2>&1 || true
  if grep -q "engine amhex" "$folder/info.txt"; then break; fi
  if ! kill -0 "$(cat "$pid_file")" 2>/dev/null; then
    cat "$folder/amhexd.log" >&2
    rm -f "$pid_file"
    fail "the server ended"
  fi
  sleep 0.2
done
grep -q "engine amhex" "$folder/info.txt" || fail "the server does not answer: $(cat "$folder/info.txt")"
grep -v "limits\." "$folder/info.txt"

say "4/5  A scan: a machined bracket seen by simulated scanners, Draco-compressed"
"$amhex" demo --out "$folder/demo.drc"

say "5/5  The mesh, $cells cells wanted"
"$amhex" mesh "$folder/demo.drc" --server "$server" --cells "$cells" \
  -o "$folder/demo.vtu" --picture "$folder/demo.png" --json "$folder/demo.json"

cat <<END

The mesh       $folder/demo.vtu   (ParaView opens it)
Cut open       $folder/demo.png
Figures        $folder/demo.json
Server         $server, log in $folder/amhexd.log, metrics on http://127.0.0.1:$metrics_port/metrics
Your own scan  $amhex mesh SCAN.drc --server $server -o SCAN.vtu
Stop           deploy/quickstart.sh --stop
END
