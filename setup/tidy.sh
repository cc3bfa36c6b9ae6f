#!/usr/bin/env bash
# Runs clang-tidy, with the checks of .clang-tidy, over the C++ of engine, plugins and tools as a
# build compiles it. Exit code: 1 if it has something to say.
#   setup/tidy.sh [BUILD [REGEX]]     BUILD: build; REGEX: of files, e.g. engine/noise
# Needs Debian's clang-tidy. Takes about half a minute a file.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
build=${1:-build} files=${2:-}
[ -e "$build/compile_commands.json" ] ||
  { echo "tidy.sh: found no $build/compile_commands.json, expected a build: ./test.sh" >&2; exit 2; }
command -v run-clang-tidy >/dev/null ||
  { echo "tidy.sh: found no run-clang-tidy: apt-get install clang-tidy" >&2; exit 2; }
# Kernels are one body for all instruction sets, so one set is enough.
log=$(mktemp)
trap 'rm -f "$log"' EXIT
run-clang-tidy -quiet -p "$build" -j "$(nproc)" \
  -extra-arg=-DHWY_COMPILE_ONLY_STATIC \
  "$PWD/(?=(engine|plugins|tools)/).*$files.*\.cpp$" 2>&1 | sed 's/\x1b\[[0-9;]*m//g' >"$log" || true
if grep -E "(warning|error): .*\[" "$log" | sort -u; then exit 1; fi
grep -q "clang-tidy" "$log" || { echo "tidy.sh: no file matches $files" >&2; exit 2; }
