#!/usr/bin/env bash
# Builds Debian's oneTBB, the version that is installed, with the thread sanitizer, and prints the
# folder of the library. Without it the sanitizer does not see what oneTBB's threads wait for and
# takes nearly every parallel loop for a race.
#
#   LD_LIBRARY_PATH=$(tests/instrumented_tbb.sh build/tsan-tbb) build/tsan/tests/engine_tests
#
# Takes the source from where apt takes packages, without touching its settings or lists.
set -euo pipefail

folder=$(mkdir -p "${1:?usage: $0 FOLDER}" && cd "$1" && pwd)
version=$(dpkg-query -W -f '${source:Version}' libtbb-dev)
built="$folder/$version"
if [[ ! -e "$built/libtbb.so.12" ]]; then
  exec 3>&1 >&2
  mkdir -p "$folder"/{sources,lists/partial,cache/archives/partial}
  for file in /etc/apt/sources.list{,.d/*}; do
    [[ -f $file ]] || continue
    case "$file" in
      *.sources) sed 's/^Types:.*/Types: deb-src/' "$file" >"$folder/sources/$(basename "$file")" ;;
      *.list) sed -n 's/^deb /deb-src /p' "$file" >"$folder/sources/$(basename "$file")" ;;
    esac
  done
  apt=(apt-get -qq -o "Dir::Etc::sourcelist=/dev/null" -o "Dir::Etc::sourceparts=$folder/sources"
    -o "Dir::State::lists=$folder/lists" -o "Dir::Cache=$folder/cache" -o "APT::Sandbox::User=")
  "${apt[@]}" update
  rm -rf "$folder/source"
  mkdir "$folder/source"
  (cd "$folder/source" && "${apt[@]}" source --download-only "onetbb=$version")
  tar -C "$folder/source" --strip-components=1 -xf "$folder/source"/onetbb_*.orig.tar.*
  cmake -S "$folder/source" -B "$folder/build" -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo \
    -DCMAKE_CXX_FLAGS="-fsanitize=thread -Wno-tsan" -DTBB_TEST=OFF -DTBB_STRICT=OFF -DTBBMALLOC_BUILD=OFF
  cmake --build "$folder/build" --target tbb
  mkdir -p "$built"
  cp -P "$folder"/build/*/libtbb.so* "$built"
  exec >&3
fi
echo "$built"
