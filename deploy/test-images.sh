#!/usr/bin/env bash
# Really builds the CPU image, on a Debian 12 made from packages, and drives its server with its
# client. Needs root, but neither a container engine nor an image registry.
#
#   deploy/test-images.sh [BASE_FOLDER]
#
# BASE_FOLDER: a Debian 12 root made by debootstrap earlier; made anew if not given.
# Environment: DEBIAN_MIRROR (http://deb.debian.org/debian).
set -euo pipefail

cd "$(dirname "$(readlink -f "$0")")/.."
deploy/install-packages.sh images
mirror="${DEBIAN_MIRROR:-http://deb.debian.org/debian}"
work=$(mktemp -d)
base=${1:-$work/base}
server_pid=
container=
# Everything buildah makes lies in a store of its own, which goes at the end.
buildah() { command buildah --root "$work/store" --runroot "$work/run" --storage-driver vfs "$@"; }
on_exit() {
  status=$?
  if [[ -n $server_pid ]]; then kill "$server_pid" 2>/dev/null || true; wait "$server_pid" || true; fi
  if [[ -n $container ]]; then buildah umount "$container" >/dev/null 2>&1 || true; fi
  if [[ $status -ne 0 && -s $work/server.log ]]; then tail -20 "$work/server.log"; fi
  rm -rf "$work"
  exit "$status"
}
trap on_exit EXIT
say() { printf '\n== %s  [%d s]\n' "$*" "$SECONDS"; }
passed() { echo "passed: $1"; }
fail() { echo "FAILED: $1" >&2; exit 1; }

if [[ ! -e $base/etc/debian_version ]]; then
  say "Debian 12 from $mirror"
  debootstrap --variant=minbase bookworm "$base" "$mirror" >"$work/debootstrap.log"
fi

say "Base image"
scratch=$(buildah from scratch)
buildah add -q "$scratch" "$base" / >/dev/null
buildah commit -q "$scratch" localhost/amhex-base >/dev/null
buildah rm "$scratch" >/dev/null

say "The image"
buildah build --isolation chroot --format docker -q -f deploy/Dockerfile -t localhost/amhex \
  --build-arg BASE=localhost/amhex-base \
  --build-arg REVISION="$(git describe --always --dirty 2>/dev/null || echo unknown)" .
container=$(buildah from localhost/amhex)
root=$(buildah mount "$container")

say "What is in it"
configuration=$(buildah inspect --type image localhost/amhex)
grep -q '"User": "10001"' <<<"$configuration" || fail "it runs as root"
grep -q '"Healthcheck"' <<<"$configuration" || fail "it has no health probe"
grep -q 'org.opencontainers.image.revision' <<<"$configuration" || fail "it has no labels"
passed "not root, health probe, labels"
for program in gcc g++ cc c++ cmake ninja git curl; do
  if [[ -n $(find "$root/usr/bin" "$root/usr/local/bin" -name "$program" -print -quit) ]]; then
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
echo "size: $(du -sm "$root" | cut -f1) MB, of it $(du -sm "$root/usr/local" | cut -f1) MB of amhex"

say "It runs"
# As a container engine would: the root read-only, user 10001, a data folder and a /tmp of its own,
# a network of its own, the image's own command line.
mkdir "$work/data" "$work/tmp"
chown 10001:10001 "$work/data" "$work/tmp"
mapfile -t words < <(python3 -c '
import json, sys
config = json.load(sys.stdin)["Docker"]["config"]
print(*config["Entrypoint"], *config["Cmd"], sep="\n")' <<<"$configuration")
enter=(chroot --userspec=10001:10001 "$root"
  env -i PATH=/usr/local/bin:/usr/bin:/bin HOME=/var/lib/amhex)
unshare --mount --net bash -c '
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
inside() { nsenter --target "$server_pid" --mount --net "${enter[@]}" "$@"; }
for _ in $(seq 300); do
  if inside amhex info --server 127.0.0.1:50051 --patience 1 >"$work/info" 2>&1; then break; fi
  kill -0 "$server_pid" 2>/dev/null || fail "the server ended"
  sleep 0.2
done
inside amhex info --server 127.0.0.1:50051 --patience 2 >/dev/null || fail "it does not answer its probe"
passed "it answers its health probe"
# Not even by root.
if nsenter --target "$server_pid" --mount touch "$root/usr/local/here" 2>/dev/null; then
  fail "its root can be written to"
fi
passed "its root is read-only"
inside amhex demo --shape cube --surface --resolution 12 -o /tmp/cube.drc >/dev/null
inside amhex mesh /tmp/cube.drc --server 127.0.0.1:50051 --cells 200 -o /tmp/cube.vtu --quiet
[[ -s $work/tmp/cube.vtu ]] || fail "no mesh"
passed "its client gets a mesh of a cube"
kill -TERM "$server_pid"
wait "$server_pid" || fail "it does not end with 0"
server_pid=
passed "it ends when asked to"
say "all image tests passed"
