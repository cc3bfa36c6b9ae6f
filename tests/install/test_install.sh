#!/usr/bin/env bash
# test_install.sh CMAKE BUILD HOST COMPILER REFERENCE LIBDIR SANITIZE
# Installs BUILD, moves the installation, then builds the C program in HOST outside the source tree,
# once with find_package(solidtex) and once with pkg-config. Both must print what REFERENCE, linked
# to the build tree's library, prints for every installed model. Then runs what else is installed.
set -euo pipefail
cmake=$1 build=$2 host=$3 compiler=$4 reference=$5 libdir=$6 sanitize=${7:-}
unset SOLIDTEX_MODEL_PATH
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

fail() { echo "error: $*" >&2; exit 1; }

"$cmake" --install "$build" --prefix "$work/first" > "$work/install.log" || { cat "$work/install.log"; fail "install"; }
mv "$work/first" "$work/moved"
prefix=$work/moved
cp -r "$host" "$work/host"
flags=()
[ -z "$sanitize" ] || flags=("-fsanitize=$sanitize")

echo "-- find_package"
"$cmake" -S "$work/host" -B "$work/host/build" -DCMAKE_PREFIX_PATH="$prefix" \
  -DCMAKE_C_COMPILER="$compiler" -DCMAKE_C_FLAGS="${flags[*]}" > /dev/null
"$cmake" --build "$work/host/build" > /dev/null

echo "-- pkg-config"
export PKG_CONFIG_PATH=$prefix/$libdir/pkgconfig
# shellcheck disable=SC2046  # several words on purpose
"$compiler" -std=c99 "${flags[@]}" "$work/host/host.c" -o "$work/host/host-pc" \
  $(pkg-config --cflags --libs solidtex) -Wl,-rpath,"$(pkg-config --variable=libdir solidtex)"

models=("$(pkg-config --variable=models solidtex)"/*.solidtex)
[ -s "$prefix/share/doc/solidtex/LICENSE" ] || fail "no licence is installed in $prefix"
[ -f "${models[0]}" ] || fail "no model is installed in $prefix"
for model in "${models[@]}"; do
  name=$(basename "$model" .solidtex)
  expected=$("$reference" "$name")
  for program in "$work/host/build/host" "$work/host/host-pc"; do
    [ "$("$program" "$name")" = "$expected" ] || fail "$program prints other values for $name"
  done
  echo "$name: $(wc -l <<< "$expected") lines agree"
done
[ "$(sort -u <<< "$expected" | wc -l)" -gt 20 ] || fail "the values of $name hardly vary"

echo "-- installed programs"
for program in "$build"/bin/solidtex-*; do
  installed=$prefix/bin/$(basename "$program")
  "$installed" --version > /dev/null || fail "$installed does not run"
  cmp <("$installed" --completion bash) \
    "$prefix/share/bash-completion/completions/$(basename "$program")" || fail "no completion"
done
ldd "$prefix"/bin/solidtex-* | grep libsolidtex | grep -vF "$prefix" &&
  fail "an installed program uses another libsolidtex"

# A plugin with sanitizers cannot be loaded by a program without.
plugins=$prefix/$libdir/openimageio
if [ -z "$sanitize" ] && [ -f "$plugins/solidtex.imageio.so" ]; then
  echo "-- OpenImageIO plugin"
  described=$(OIIO_LIBRARY_PATH=$plugins iinfo -v "$name.solidtex?size=8")
  grep -F "solidtex:model: \"$name\"" <<< "$described" || fail "iinfo says: $described"
  ldd "$plugins/solidtex.imageio.so" | grep libsolidtex | grep -vF "$prefix" &&
    fail "the installed plugin uses another libsolidtex"
fi
exit 0
