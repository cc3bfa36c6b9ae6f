#!/usr/bin/env bash
# From a fresh Debian machine to a rendered picture: installs what is missing, builds, renders the
# demo scene with the shipped models. Safe to run again: it only does what is left to do.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

source setup/common.sh
say "1/3  Debian packages"
install_debian_packages setup/debian-build.txt
prepare_onnxruntime
say "2/3  building solidtex into build/"
tests=()
[ -e build/CMakeCache.txt ] || tests=(-DSOLIDTEX_BUILD_TESTS=OFF)  # test.sh builds them
build_solidtex "${tests[@]}"
say "3/3  rendering scenes/demo.json"
build/bin/solidtex-render scenes/demo.json -o build/demo.png --force

say "The picture: $PWD/build/demo.png"
say "Next: look at it, then try  build/bin/solidtex-bake granite-grey --size 128 --preview build/granite.png -o build/granite.npy"
