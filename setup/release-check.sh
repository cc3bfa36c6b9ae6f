#!/usr/bin/env bash
# The release checklist: runs every check that a machine can make, then lists what is left for a
# person. Changes nothing but the folder build/.
#   setup/release-check.sh [--quick]     --quick: no tests, no packages
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
quick=${1:-}
failures=0

check() {  # check "what must be true" COMMAND...
  local what=$1
  shift
  if "$@" >/tmp/release-check.$$ 2>&1; then
    echo "ok      $what"
  else
    echo "FAILED  $what"
    tail -n 5 /tmp/release-check.$$ | sed 's/^/        /'
    failures=$((failures + 1))
  fi
  rm -f /tmp/release-check.$$
}

# Builds the library from two copies of the committed sources, in folders of two names, without a
# compiler cache, and compares the bytes.
same_bytes_twice() {
  local work copy
  work=$(mktemp -d)
  for copy in first a-folder-with-a-longer-name; do
    mkdir "$work/$copy"
    git archive HEAD | tar -x -C "$work/$copy"
    (cd "$work/$copy" && export CCACHE_DISABLE=1 &&
       cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release -DSOLIDTEX_BUILD_RENDERER=OFF \
         -DSOLIDTEX_BUILD_OPENIMAGEIO=OFF -DSOLIDTEX_BUILD_TOOLS=OFF -DSOLIDTEX_BUILD_PYTHON=OFF \
         -DSOLIDTEX_BUILD_TESTS=OFF && cmake --build build --target solidtex) || return 1
  done
  cmp "$work"/*/build/lib/libsolidtex.so && rm -r "$work"
}

# Programs of packages check the use of memory as they run: the preset "release" turns that on.
hardened_packages() {
  cmake --preset release && cmake --build --preset release && (cd build && cpack) || return 1
  local work file
  work=$(mktemp -d)
  tar -x -C "$work" -f build/solidtex-*.tar.gz || return 1
  for file in "$work"/*/bin/solidtex-bake "$work"/*/lib*/libsolidtex.so; do
    readelf --wide --dynamic "$file" | grep -q "NOW" || { echo "$file: not hardened"; return 1; }
    readelf --wide --dyn-syms "$file" | grep -q "__stack_chk_fail" || return 1
  done
  rm -r "$work"
}

version=$(sed -n 's/^project(solidtex VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
echo "solidtex $version"
check "everything is committed" test -z "$(git status --porcelain)"
check "python_export has the version" grep -q "__version__ = \"$version\"" \
  python_export/solidtex_export/__init__.py
check "CITATION.cff has the version" grep -q "^version: $version$" CITATION.cff
check "CHANGELOG.md has the version with a date" \
  grep -Eq "^## $version – [0-9]{4}-[0-9]{2}-[0-9]{2}$" CHANGELOG.md
check "the tag v$version is free" sh -c "! git rev-parse -q --verify refs/tags/v$version"
if [ "$quick" != --quick ]; then
  check "all tests pass" ./test.sh
  check "clang-tidy finds nothing" setup/tidy.sh
  check "two builds of the library have the same bytes" same_bytes_twice
  check "setup/sbom.py writes the bill of materials" \
    .venv/bin/python setup/sbom.py build -o build/solidtex.cdx.json --force
  check "cpack writes hardened packages" hardened_packages
  check "setup/wheel.sh writes a wheel with all programs" setup/wheel.sh build/wheels
fi

cat <<END

For a person:
- Render scenes/demo.json and docs/scenes/*.json, and look at each picture.
- Follow the README on a fresh machine, from its first line.
- As root, on Debian 12 and on 13: setup/bare.sh SUITE FOLDER build/*.deb build/*.tar.gz
  build/wheels/*.whl, which installs and runs them in a Debian that has nothing else.
- git tag -s v$version, then push the tag with the packages of build/ and build/wheels/.
END
[ "$failures" -eq 0 ] || { echo "$failures checks failed"; exit 1; }
