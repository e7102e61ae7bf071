#!/usr/bin/env bash
# Installs the Debian packages of the named sections of packages.txt, only what is missing.
#
#   deploy/install-packages.sh build test
#
# Needs no network when nothing is missing. Runs as root, or through sudo where there is one.
set -euo pipefail

list="$(dirname "$(readlink -f "$0")")/packages.txt"
if [[ $# -eq 0 ]]; then
  echo "usage: $0 SECTION..." >&2
  exit 2
fi

wanted=()
for section in "$@"; do
  packages="$(awk -v section="[$section]" '
    /^\[/ { inside = ($0 == section); next }
    inside && NF && !/^#/ { print $1 }' "$list")"
  if [[ -z $packages ]]; then
    echo "$0: packages.txt has no section [$section]" >&2
    exit 2
  fi
  # shellcheck disable=SC2206  # one word per package
  wanted+=($packages)
done

missing=()
for package in "${wanted[@]}"; do
  status="$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)"
  [[ $status == installed ]] || missing+=("$package")
done
if [[ ${#missing[@]} -eq 0 ]]; then
  exit 0
fi

as_root=()
if [[ $EUID -ne 0 ]]; then
  if ! command -v sudo >/dev/null; then
    echo "$0: not root and no sudo; please install: ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi
echo "Installing ${#missing[@]} Debian packages: ${missing[*]}"
export DEBIAN_FRONTEND=noninteractive
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
  apt-get install -y -qq --no-install-recommends "${missing[@]}"
