#!/usr/bin/env bash
# The mesh that the tests with other people's software share: AMHEX AMHEXD OUTPUT.vtu
set -euo pipefail
amhex=$1 output=$3
export AMHEXD=$2
unset AMHEX_SERVER
mkdir -p "$(dirname "$output")"
"$amhex" demo --points 20000 -o "${output%.vtu}.drc"
"$amhex" mesh "${output%.vtu}.drc" --cells 2500 -o "$output" --quiet
