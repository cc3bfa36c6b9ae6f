#!/usr/bin/env bash
# Installs what the tests need (Debian packages, a Python environment in .venv), builds, and runs
# every test through ctest, the Python ones included, as many at a time as there are cores. Safe to
# run again.
# Arguments are passed on to ctest:  ./test.sh -R field
# With --long first it runs the tests labelled "long" instead, which take hours.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

long=OFF label=()
if [ "${1:-}" = --long ]; then
  long=ON label=(-L long)
  shift
fi

source setup/common.sh
say "1/4  Debian packages"
install_debian_packages setup/debian-build.txt setup/debian-test.txt
prepare_onnxruntime
say "2/4  Python environment in .venv"
prepare_venv
say "3/4  building solidtex into build/"
build_solidtex -DSOLIDTEX_BUILD_TESTS=ON -DSOLIDTEX_LONG_TESTS=$long
say "4/4  running the tests"
ctest --test-dir build --output-on-failure --parallel "$(nproc)" "${label[@]}" "$@"

case " $* " in
  *" -N "*) say "The tests are built; nothing was run." ;;
  *) say "All tests passed." ;;
esac
say "Next: train on a photograph of yours:  .venv/bin/solidtex-train photo.png --minutes 10 -o results/mine"
