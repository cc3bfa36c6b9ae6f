#!/usr/bin/env bash
# run_page.sh PAGE BUILD PICTURE
# Runs the first shell commands of PAGE as they are written there, in a folder where BUILD is called
# build, and compares the picture they make with PICTURE. Those of wheels are run, when asked, by
# tests/hosts/test_openimageio_wheel.py.
set -euo pipefail
page=$1 build=$2 picture=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "error: $*" >&2; exit 1; }

awk '/^```/ { if (inside) exit; inside = ($0 == "```sh"); next } inside' "$page" > "$work/commands.sh"
[ -s "$work/commands.sh" ] || fail "$page has no commands"
ln -s "$build" "$work/build"
PATH=/usr/bin:$PATH  # oiiotool of an active .venv has no plugins
cd "$work"
bash -euo pipefail -x commands.sh > output.txt || { cat output.txt; fail "the commands of $page"; }
grep -q "1024 x 1024 x 1024" output.txt || { cat output.txt; fail "iinfo does not see the volume"; }
# Encoders differ a little between versions.
idiff -fail 0.04 -failpercent 1 -hardfail 0.2 "$(basename "$picture")" "$picture"
