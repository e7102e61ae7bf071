#!/usr/bin/env bash
# Really builds an image, on a Debian 12 made from packages, and drives its server with its client.
# Needs root, but neither a container engine nor an image registry.
#
#   deploy/test-images.sh [--cuda TOOLKIT] [--keep FOLDER]
#
#   --cuda TOOLKIT  the image for GPUs instead of that for CPUs, with nvcc from this folder (such as
#                   /usr/local/cuda) instead of NVIDIA's repository; needs no GPU, uses none, and is
#                   skipped where the folder holds no nvcc
#   --keep FOLDER   keeps the base and what was compiled there for the next time
#
# Environment: DEBIAN_MIRROR (http://deb.debian.org/debian), CUDA_ARCHITECTURES (the Dockerfile's).
set -euo pipefail

cd "$(dirname "$(readlink -f "$0")")/.."
mirror="${DEBIAN_MIRROR:-http://deb.debian.org/debian}"
# Of the image, what its base holds included; docs/operations.md tells the sizes.
max_image_megabytes=250
name=amhex
dockerfile=deploy/Dockerfile
toolkit=
keep=
while [[ $# -gt 0 ]]; do
  case "$1" in
    --cuda) toolkit="${2:?--cuda needs a folder}"; name=amhex-cuda; dockerfile=deploy/Dockerfile.cuda; shift ;;
    --keep) keep="${2:?--keep needs a folder}"; shift ;;
    *) sed -n '2,13s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
  esac
  shift
done
if [[ -n $toolkit && ! -x $toolkit/bin/nvcc ]]; then
  echo "SKIPPED: the image $name: no nvcc in $toolkit/bin"
  exit 0
fi
deploy/install-packages.sh images
work=$(mktemp -d)
store=${keep:-$work}
mkdir -p "$store/temporary"
store=$(readlink -f "$store")
base=$store/base
server_pid=
container=
# Everything buildah makes lies in a store of its own; the cache of the Dockerfile's compiler, too.
export TMPDIR=$store/temporary
buildah() { command buildah --root "$store/store" --runroot "$work/run" --storage-driver vfs "$@"; }
on_exit() {
  status=$?
  # unshare itself heeds no signal but this one, and takes what it started with it.
  if [[ -n $server_pid ]]; then kill -KILL "$server_pid" 2>/dev/null || true; wait "$server_pid" || true; fi
  if [[ -n $container ]]; then buildah rm "$container" >/dev/null 2>&1 || true; fi
  if [[ $status -ne 0 && -s $work/server.log ]]; then tail -20 "$work/server.log"; fi
  rm -rf "$work"
  exit "$status"
}
trap on_exit EXIT
say() { printf '\n== %s  [%d s]\n' "$*" "$SECONDS"; }
passed() { echo "passed: $1"; }
fail() { echo "FAILED: $1" >&2; exit 1; }

# Commits a folder as an image, FROM another or from nothing.
make_image() {
  local from=$1 folder=$2 destination=$3 image=$4 draft
  draft=$(buildah from "$from")
  buildah add -q "$draft" "$folder" "$destination" >/dev/null
  buildah commit -q "$draft" "$image" >/dev/null
  buildah rm "$draft" >/dev/null
}

if ! buildah inspect --type image localhost/amhex-base >/dev/null 2>&1; then
  say "Debian 12 from $mirror"
  rm -rf "$base"
  debootstrap --variant=minbase bookworm "$base" "$mirror" >"$work/debootstrap.log"
  # As in debian:12-slim: no documentation, now and in packages to come, and nothing of apt's.
  printf 'path-exclude /usr/share/%s/*\n' doc man info locale >"$base/etc/dpkg/dpkg.cfg.d/slim"
  rm -rf "$base"/usr/share/{doc,man,info,locale}/* "$base"/var/lib/apt/lists/*
  rm -f "$base"/var/cache/apt/archives/*.deb "$base"/var/cache/apt/*.bin
  make_image scratch "$base" / localhost/amhex-base
  rm -rf "$base"
fi
build_base=localhost/amhex-base
if [[ -n $toolkit ]]; then
  build_base=localhost/amhex-build-base
  if ! buildah inspect --type image "$build_base" >/dev/null 2>&1; then
    say "The CUDA toolkit of $toolkit"
    mkdir -p "$work/cuda/lib64"
    cp -aL "$toolkit"/{bin,nvvm,include} "$work/cuda"
    cp -aL "$toolkit"/lib64/libcudart_static.a "$toolkit"/lib64/libcudadevrt.a "$work/cuda/lib64"
    make_image localhost/amhex-base "$work/cuda" /usr/local/cuda "$build_base"
    rm -rf "$work/cuda"
  fi
fi

say "The image $name"
buildah build --isolation chroot --format docker -f "$dockerfile" -t "localhost/$name" \
  --build-arg BASE=localhost/amhex-base --build-arg BUILD_BASE="$build_base" \
  --build-arg JOBS="$(nproc)" \
  ${CUDA_ARCHITECTURES:+--build-arg CUDA_ARCHITECTURES="$CUDA_ARCHITECTURES"} \
  --build-arg REVISION="$(git describe --always --dirty 2>/dev/null || echo unknown)" . \
  >"$work/build.log" 2>&1 || { tail -40 "$work/build.log"; fail "it cannot be built"; }
container=$(buildah from "localhost/$name")
root=$(buildah mount "$container")

say "What is in it"
configuration=$(buildah inspect --type image "localhost/$name")
grep -q '"User": "10001"' <<<"$configuration" || fail "it runs as root"
grep -q '"Healthcheck"' <<<"$configuration" || fail "it has no health probe"
grep -q 'org.opencontainers.image.revision' <<<"$configuration" || fail "it has no labels"
passed "not root, health probe, labels"
for program in gcc g++ cc c++ cmake ninja ccache git curl nvcc; do
  if [[ -n $(find "$root/usr" "$root/opt" -name "$program" \( -type f -o -type l \) -print -quit) ]]; then
    fail "$program is in it"
  fi
done
passed "no compilers"
python3 -c '
import json, sys
names = {package["name"] for package in json.load(open(sys.argv[1]))["packages"]}
sys.exit(not {"amhex", "libgrpc++1.51", "libpq5"} <= names)' \
  "$root/usr/local/share/amhex/sbom.spdx.json" || fail "its SBOM does not name its parts"
passed "an SBOM"
if [[ -n $toolkit ]]; then
  [[ -n $(find "$root/usr/local/lib" -name libamhex_engine_cuda.so) ]] || fail "it has no CUDA library"
  passed "the CUDA library"
fi
megabytes=$(du -sm "$root" | cut -f1)
echo "size: $megabytes MB, of it $(du -sm "$root/usr/local" | cut -f1) MB of amhex"
((megabytes < max_image_megabytes)) || fail "it is larger than $max_image_megabytes MB"
passed "smaller than $max_image_megabytes MB"

say "It runs"
# As a container engine would: the root read-only, user 10001, a data folder and a /tmp of its own,
# a network of its own, process 1 of its own processes, the image's own command line.
mkdir "$work/data" "$work/tmp"
chown 10001:10001 "$work/data" "$work/tmp"
mapfile -t words < <(python3 -c '
import json, sys
config = json.load(sys.stdin)["Docker"]["config"]
print(*config["Entrypoint"], *config["Cmd"], sep="\n")' <<<"$configuration")
enter=(chroot --userspec=10001:10001 "$root"
  env -i PATH=/usr/local/bin:/usr/bin:/bin HOME=/var/lib/amhex)
unshare --mount --net --pid --fork --kill-child bash -c '
  set -e
  ip link set lo up
  mount --bind "$1" "$1"
  mount --bind "$2/data" "$1/var/lib/amhex"
  mount --bind "$2/tmp" "$1/tmp"
  mount -t proc proc "$1/proc"
  mount -o remount,bind,ro "$1"
  shift 2
  exec "$@"' bash "$root" "$work" "${enter[@]}" "${words[@]}" >"$work/server.log" 2>&1 &
server_pid=$!
# unshare stays; its child is process 1.
children=/proc/$server_pid/task/$server_pid/children
for _ in $(seq 100); do
  first_pid=$(cat "$children" 2>/dev/null || true)
  first_pid=${first_pid% }
  [[ -z $first_pid ]] || break
  sleep 0.1
done
[[ -n $first_pid ]] || fail "it does not start"
inside() { nsenter --target "$first_pid" --mount --net --pid "${enter[@]}" "$@"; }
for _ in $(seq 300); do
  if inside amhex info --server 127.0.0.1:50051 --patience 1 >"$work/info" 2>&1; then break; fi
  kill -0 "$server_pid" 2>/dev/null || fail "the server ended"
  sleep 0.2
done
inside amhex info --server 127.0.0.1:50051 --patience 2 >/dev/null || fail "it does not answer its probe"
passed "it answers its health probe"
# Not even by root.
if nsenter --target "$first_pid" --mount touch "$root/usr/local/here" 2>/dev/null; then
  fail "its root can be written to"
fi
passed "its root is read-only"
inside amhex demo --shape cube --surface --resolution 12 -o /tmp/cube.drc >/dev/null
inside amhex mesh /tmp/cube.drc --server 127.0.0.1:50051 --cells 200 -o /tmp/cube.vtu --quiet
[[ -s $work/tmp/cube.vtu ]] || fail "no mesh"
passed "its client gets a mesh of a cube"
if [[ -n $toolkit ]]; then
  inside amhex info --server 127.0.0.1:50051 >"$work/info"
  grep backend "$work/info"
  grep -Eq '^  backend cpu +available' "$work/info" || fail "it does not offer the CPU"
  grep -Eq '^  backend cuda +not available: .*driver' "$work/info" || fail "it does not say that CUDA has no driver"
  status=0
  inside amhex mesh /tmp/cube.drc --server 127.0.0.1:50051 --cells 200 --backend cuda \
    -o /tmp/cuda.vtu --quiet 2>"$work/refusal" || status=$?
  cat "$work/refusal"
  ((status == 10)) || fail "asked for CUDA, it ends with $status instead of 10"
  grep -q driver "$work/refusal" || fail "the refusal does not name the driver"
  [[ ! -e $work/tmp/cuda.vtu ]] || fail "asked for CUDA, it meshes on the CPU"
  passed "without a driver, it meshes on the CPU and says why not on CUDA"
fi
# An orphan becomes a child of process 1 and stays as a zombie if that does not care.
inside sh -c 'sleep 0.2 &'
zombies() {
  local status
  for status in $(printf '/proc/%s/status\n' $(cat "/proc/$first_pid/task/$first_pid/children")); do
    if grep -q '^State:.Z' "$status" 2>/dev/null; then return 0; fi
  done
  return 1
}
sleep 1
for _ in $(seq 50); do zombies || break; sleep 0.2; done
! zombies || fail "process 1 does not reap orphans"
passed "process 1 reaps orphans"
kill -TERM "$first_pid"
wait "$server_pid" || fail "it does not end with 0"
server_pid=
passed "it ends when asked to"
say "all image tests passed"
