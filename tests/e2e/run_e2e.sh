#!/usr/bin/env bash
# The real programs together: the client with a private server and worker, from a file to a mesh.
#
#   tests/e2e/run_e2e.sh AMHEX AMHEXD [GROUP]...     groups: inputs errors access commands tools restarts; default all
#
# Every test prints one line; the exit status is 0 only if all passed.
set -uo pipefail

if [[ $# -lt 2 ]]; then sed -n '2,7s/^# \{0,1\}//p' "$0"; exit 2; fi
amhex=$(readlink -f "$1")
amhexd=$(readlink -f "$2")
shift 2
groups=("$@")
if [[ ${#groups[@]} -eq 0 ]]; then groups=(inputs errors access commands tools restarts); fi

folder=$(mktemp -d)
server_pid=
on_exit() {
  if [[ -n $server_pid ]]; then kill "$server_pid" 2>/dev/null; wait "$server_pid" 2>/dev/null; fi
  rm -rf "$folder"
}
trap on_exit EXIT
cd "$folder" || exit 1
export AMHEXD=$amhexd TMPDIR=$folder
unset AMHEX_SERVER

failures=0
pass() { echo "passed: $1"; }
fail() {
  echo "FAILED: $1"
  shift
  printf '    %s\n' "$@"
  for log in stdout stderr; do
    if [[ -s $log ]]; then sed "s/^/    $log: /" "$log" | tail -15; fi
  done
  failures=$((failures + 1))
}

# check NAME CONDITION... : the condition is a command that must succeed.
check() {
  local name=$1
  shift
  if "$@"; then pass "$name"; else fail "$name" "not true: $*"; fi
}

run() {  # runs amhex; leaves its status in $status, its output in stdout and stderr
  "$amhex" "$@" >stdout 2>stderr
  status=$?
}

# meshes NAME INPUT [FLAG...] : a valid mesh must come out, and the private server must be gone.
meshes() {
  local name=$1 input=$2
  shift 2
  rm -f out.vtu out.json out.png
  run mesh "$input" -o out.vtu --json out.json --picture out.png "$@"
  if [[ $status -ne 0 ]]; then fail "$name" "exit status $status"; return; fi
  for file in out.vtu out.json out.png; do
    if [[ ! -s $file ]]; then fail "$name" "$file is missing or empty"; return; fi
  done
  if ! grep -q '"min_scaled_jacobian": 0\.[0-9]*[1-9]\|"min_scaled_jacobian": 1' out.json; then
    fail "$name" "no positive scaled Jacobian in out.json"
    return
  fi
  if compgen -G "$folder/amhex-*" >/dev/null; then
    fail "$name" "the private server's folder is still there"
    return
  fi
  pass "$name"
}

# refuses NAME STATUS MESSAGE COMMAND... : that exit status, the message on stderr, no mesh.
refuses() {
  local name=$1 wanted=$2 message=$3
  shift 3
  rm -f out.vtu
  run "$@"
  if [[ $status -ne $wanted ]]; then
    fail "$name" "exit status $status instead of $wanted"
  elif ! grep -qiE -- "$message" stderr; then
    fail "$name" "stderr does not say: $message"
  elif [[ -e out.vtu ]]; then
    fail "$name" "a mesh was written"
  else
    pass "$name"
  fi
}

start_server() {  # ADDRESS DATA_FOLDER; leaves its id in $server_pid
  "$amhexd" --listen "$1" --data-dir "$folder/$2" --metrics-listen "" >>server.log 2>&1 &
  server_pid=$!
  for _ in $(seq 100); do
    if "$amhex" info --server "$1" --patience 0.1 >/dev/null 2>&1; then return; fi
    sleep 0.1
  done
}

stop_server() {
  kill "$server_pid"
  wait "$server_pid" 2>/dev/null
  server_pid=
}

test_inputs() {
  local format
  "$amhex" demo --shape cube --surface --resolution 12 -o cube.ply >/dev/null
  for format in drc ply obj off stl; do
    "$amhex" demo --shape cube --surface --resolution 12 -o "cube.$format" >/dev/null
    meshes "a cube from .$format" "cube.$format" --cells 200 --quiet
  done
  check "all cells of a cube are hexahedra" grep -q '"hexahedra_ratio": 1[,.]' out.json
  "$amhex" demo --shape sphere --surface --resolution 24 -o sphere.ply >/dev/null
  meshes "a sphere" sphere.ply --cells 500 --quiet
  "$amhex" demo --shape torus --points 6000 -o torus.drc >/dev/null
  meshes "a cloud of a torus" torus.drc --cells 800 --quiet
  "$amhex" demo --points 20000 -o bracket.drc >/dev/null
  meshes "a cloud of the bracket" bracket.drc --cells 2500 --quiet
  run mesh cube.ply --cells 200 -o first.mesh --quiet
  run mesh cube.ply --cells 200 -o second.mesh --quiet
  check "the same input gives the same mesh" cmp -s first.mesh second.mesh
}

test_errors() {
  "$amhex" demo --shape cube --surface --resolution 12 -o cube.drc >/dev/null
  "$amhex" demo --shape cube --points 500 -o cloud.drc >/dev/null
  : >empty.drc
  : >cube.step
  printf 'MeshVersionFormatted 2\nDimension 3\nVertices\n4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\nTetrahedra\n1\n1 2 3 4 0\nEnd\n' >cube.mesh
  head -c 100 cube.drc >cut.drc
  head -c 60 cloud.drc >cut_cloud.drc
  printf 'solid nothing\nendsolid\n' >nothing.stl
  printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >flat.obj
  printf 'v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n' >nan.obj
  printf 'ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\nnan 0 0\n1 1 1\n' >nan.ply
  printf 'DRACO\x02\x03\x00\x00\x00\x00\xff\xff\xff\x7f\x00\x00\x00\x00' >liar.drc
  refuses "a missing file" 3 "no such file" mesh missing.stl -o out.vtu
  refuses "a missing file of whatever extension" 3 "no such file" info missing
  refuses "a picture that is none" 2 "pictures are written to .png" mesh cube.drc -o out.vtu --picture out.jpg
  refuses "an unknown input format" 3 "volume meshes from .vtk" mesh cube.step -o out.vtu
  refuses "an unknown output format" 2 "unknown extension" mesh cube.drc -o out.xyz
  refuses "a missing output folder" 7 "does not exist" mesh cube.drc -o nowhere/out.vtu
  refuses "an empty file" 3 "the file is empty" mesh empty.drc -o out.vtu
  refuses "a cut-off surface" 3 "draco|damaged|cut off" mesh cut.drc -o out.vtu
  refuses "a cut-off cloud" 3 "draco|damaged|cut off" mesh cut_cloud.drc -o out.vtu
  refuses "a file that claims too much" 3 "claim" mesh liar.drc -o out.vtu
  refuses "a file without triangles" 3 "no triangle" mesh nothing.stl -o out.vtu
  refuses "a flat triangle" 3 "error" mesh flat.obj -o out.vtu
  refuses "a surface with NaN" 3 "not finite" mesh nan.obj -o out.vtu
  refuses "a cloud with NaN" 3 "not finite" mesh nan.ply -o out.vtu
  refuses "an absurd number of cells" 3 "cell_count" mesh cube.drc --cells 999999999999 -o out.vtu
  refuses "no cells" 2 "cells" mesh cube.drc --cells 0 -o out.vtu
  refuses "cells and edge length" 2 "edge-length" mesh cube.drc --cells 9 --edge-length 1 -o out.vtu
  refuses "an absurd edge length" 3 "edge_length" mesh cube.drc --edge-length 1e-9 -o out.vtu
  refuses "a parameter out of range" 3 "min_quality" mesh cube.drc --min-quality 7 -o out.vtu
  refuses "no server there" 4 "cannot be reached" \
    mesh cube.drc --server 127.0.0.1:1 --patience 0.5 -o out.vtu
  check "and what to do is said" grep -q "is the address right" stderr
  refuses "a folder as authorities" 3 "cannot be read" \
    mesh cube.drc --server 127.0.0.1:1 --tls-ca / -o out.vtu
  refuses "a job out of time" 6 "RUN_TIMEOUT" mesh cube.drc --cells 20000 --time-limit 0.01 -o out.vtu
  check "and how to have more is said" grep -q -- "--time-limit allows more" stderr
  refuses "no subcommand" 2 "a command is missing"
  refuses "a mistyped command" 2 "no such command: meash; did you mean mesh" meash cube.drc -o out.vtu
  refuses "an unknown flag" 2 "frobnicate" mesh cube.drc --frobnicate -o out.vtu
  refuses "a mistyped flag" 2 "did you mean --output" mesh cube.drc --ouput out.vtu
  refuses "a list of no server" 2 "AMHEX_SERVER" list
  refuses "a scan as STL" 2 "--surface writes one" demo -o scan.stl
  refuses "distances without the input" 3 "--input FILE" picture cube.mesh -o far.png --cut none --colour distance
  AMHEX_WORKER=/bin/false refuses "a worker that does not start" 4 "worker does not start" \
    mesh cube.drc -o out.vtu
  check "and why is said" grep -q "worker_start_failed" stderr
  AMHEXD=/nowhere/amhexd refuses "no amhexd" 4 "no program" mesh cube.drc -o out.vtu
  if "$amhex" info | grep -q 'backend cuda *not available'; then
    refuses "CUDA without a device" 10 "cuda" mesh cube.drc --backend cuda -o out.vtu
  fi
}

# A server that asks callers who they are.
test_access() {
  local address="unix:$folder/access_socket"
  "$amhexd" --new-token >fresh
  sed -n 's/^token: *//p' fresh >token
  echo "somebody-elses" >wrong_token
  echo "ada submit,read $(sed -n 's/^SHA-256: *//p' fresh)" >tokens
  "$amhexd" --listen "$address" --ephemeral --metrics-listen "" --tokens tokens >>server.log 2>&1 &
  server_pid=$!
  run list --server "$address" --token-file token --patience 60
  check "the right token opens" test "$status" -eq 0
  refuses "no token" 11 "NOT_AUTHENTICATED" list --server "$address"
  check "and how to show one is said" grep -q -- "--token-file" stderr
  refuses "another token" 11 "not valid" list --server "$address" --token-file wrong_token
  stop_server
}

test_commands() {
  local address="unix:$folder/socket" job
  "$amhex" demo --shape cube --surface --resolution 12 -o cube.ply >/dev/null
  start_server "$address" data
  run list --server "$address"
  check "an empty list says so" bash -c 'test ! -s stdout && grep -q "no jobs" stderr'
  run info --server "$address"
  check "info names the backends" grep -q "backend cpu" stdout
  run submit cube.ply --cells 200 --server "$address" \
    --request-id 6b0f9d4e-51a1-4f0c-9a0f-3a1d6f2a7c55
  job=$(cat stdout)
  check "submit prints a job" test "${job#jobs/}" != "$job"
  run submit cube.ply --cells 200 --server "$address" \
    --request-id 6b0f9d4e-51a1-4f0c-9a0f-3a1d6f2a7c55
  check "the same request gives the same job" test "$(cat stdout)" = "$job"
  run watch "$job" --server "$address"
  check "watch ends with the job" test "$status" -eq 0
  check "watch shows every stage's time" grep -q "place vertices" stderr
  run fetch "${job#jobs/}" --server "$address" -o fetched.vtu
  check "fetch writes the mesh" test -s fetched.vtu
  run info fetched.vtu
  check "info reads the mesh's facts" grep -q "statistics.cell_count" stdout
  run picture fetched.vtu -o fetched.png --cut x:0.4 --size 320x240
  check "picture draws it" test -s fetched.png
  AMHEX_SERVER=$address run list
  check "list names the job" grep -q "$job" stdout
  check "list says how old it is" grep -Eq "$job +succeeded +[0-9]+ (s|min) ago  [0-9]+ cells" stdout
  run cancel "$job" --server "$address"
  check "cancelling a final job changes nothing" grep -q "succeeded" stdout
  run delete "$job" --server "$address"
  check "delete removes it" test "$status" -eq 0
  refuses "a deleted job is gone" 9 "job" fetch "$job" --server "$address" -o out.vtu

  "$amhex" demo --points 30000 -o bracket.drc >/dev/null
  : >stderr  # nothing of the command before may be taken for this one's
  "$amhex" mesh bracket.drc --cells 60000 --server "$address" -o out.vtu >stdout 2>stderr &
  local client=$!
  for _ in $(seq 100); do
    if grep -q "check input" stderr; then break; fi
    sleep 0.1
  done
  kill -INT "$client"
  wait "$client"
  status=$?
  check "Ctrl-C ends the client with 130" test "$status" -eq 130
  check "Ctrl-C cancels the job" grep -q "was cancelled" stderr
  run list --server "$address" -n 1
  for _ in $(seq 100); do
    if grep -q cancelled stdout; then break; fi
    sleep 0.1
    run list --server "$address" -n 1
  done
  check "the server has cancelled it" grep -q cancelled stdout
  stop_server
}

# What works on files: convert, report, picture; and bench, events. Completion is tried in real shells (terminal.py).
test_tools() {
  local format
  "$amhex" demo --points 20000 -o bracket.drc >/dev/null
  run mesh bracket.drc --cells 2500 -o part.vtu --report part.html --progress events \
    --initialization jittered_grid --iterations 20
  check "mesh writes a report" grep -q "<canvas" part.html
  check "every event is a JSON object on a line" \
    python3 -c 'import json,sys; [json.loads(line)["event"] for line in open("stdout")]'
  check "the last event tells the exit status" \
    bash -c 'tail -n 1 stdout | grep -q "\"event\": \"end\", \"exit_status\": 0, \"outcome\""'
  check "the mesh knows how the relaxation went" \
    bash -c '"$0" info part.vtu | grep -Eq "convergence.movement = [0-9]+ numbers"' "$amhex"
  for format in vtk mesh ply obj off stl drc; do
    run convert part.vtu -o "part.$format"
    check "convert writes .$format" test -s "part.$format"
  done
  for format in msh inp; do
    run convert part.vtu -o "part.$format" --solver-ready
    check "convert writes .$format" test -s "part.$format"
    if [[ $format == msh ]]; then
      run picture part.msh -o from_msh.png
      check "a picture of a .msh is drawn" test -s from_msh.png
    fi
    rm "part.$format"
    refuses ".$format has no word for all cells" 7 "solver-ready" convert part.vtu -o "part.$format"
    check "and nothing is written" test ! -e "part.$format"
  done
  check "a .vtk knows all that a .vtu does" bash -c \
    'diff <("$0" info part.vtu | tail -n +2) <("$0" info part.vtk | tail -n +2)' "$amhex"
  run report part.vtk -o from_vtk.html
  check "and a report is made of it" grep -q "<canvas" from_vtk.html
  run convert part.vtu -o case/constant/polyMesh --solver-ready
  check "convert writes a polyMesh" test -s case/constant/polyMesh/neighbour
  refuses "an unknown format" 2 "unknown extension" convert part.vtu -o part.step
  refuses "a picture in another format" 2 "pictures are written to .png" picture part.vtu -o part.jpg
  refuses "a missing mesh" 3 "no such file" convert missing.vtu -o out.vtk
  refuses "a mesh that is none" 3 "error" report bracket.drc -o out.html
  run mesh bracket.drc --cells 2500 -o ready.inp --solver-ready --quiet
  check "mesh itself writes for solvers" grep -q "solver-ready: [0-9]* cells became" stdout
  run render part.vtu -o part.png
  check "render is another word for picture" test -s part.png
  run render part.vtu -o far.png --colour distance
  check "it shows the distance that the file knows" test -s far.png
  if command -v groff >/dev/null; then
    check "the manual page is good troff" \
      bash -c 'test -z "$("$0" manual | groff -man -Tutf8 -ww -z 2>&1)"' "$amhex"
  fi
  run bench bracket.drc --cells 500 --jobs 2 --at-once 2 --json bench.json
  check "bench measures" grep -q '"jobs_per_second": [0-9]' bench.json
}

test_restarts() {
  local address="unix:$folder/restart_socket" client
  "$amhex" demo --points 20000 -o bracket.drc >/dev/null
  start_server "$address" restart_data
  : >stderr  # nothing of the command before may be taken for this one's
  "$amhex" mesh bracket.drc --cells 2500 --server "$address" -o out.vtu >stdout 2>stderr &
  client=$!
  for _ in $(seq 200); do
    if grep -q "decode input" stderr; then break; fi
    sleep 0.05
  done
  kill -KILL "$server_pid"
  wait "$server_pid" 2>/dev/null
  start_server "$address" restart_data
  wait "$client"
  status=$?
  check "a job outlives the server's sudden end" test "$status" -eq 0
  check "the client says that it lost the connection" grep -q "trying again" stderr
  check "and that it is back" grep -q "connected again" stderr
  check "the mesh is written" test -s out.vtu

  : >stderr  # nothing of the command before may be taken for this one's
  "$amhex" mesh bracket.drc --cells 2500 -o killed.vtu >stdout 2>stderr &
  client=$!
  for _ in $(seq 200); do
    if grep -q "decode input" stderr; then break; fi
    sleep 0.05
  done
  local private_server
  private_server=$(tr -d " " <"/proc/$client/task/$client/children")
  kill -KILL "$client"
  wait "$client" 2>/dev/null
  for _ in $(seq 200); do
    if ! kill -0 "$private_server" 2>/dev/null; then break; fi
    sleep 0.05
  done
  check "a private server ends with its client" \
    test -n "$private_server" -a ! -e "/proc/$private_server/exe"
  stop_server
}

for group in "${groups[@]}"; do "test_$group"; done
if [[ $failures -gt 0 ]]; then
  echo "$failures end-to-end tests failed"
  exit 1
fi
echo "all end-to-end tests passed"
