#!/usr/bin/env bash
# Builds the engine for another processor and runs its tests and its golden hashes under QEMU.
#   setup/cross.sh aarch64|s390x FOLDER [--hashes]     --hashes: no other tests, which take long
# FOLDER becomes a Debian 12 of its own, made by debootstrap (root, about 1.5 GB); nothing else on
# this machine changes. Run it again for another processor, or after an edit.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
[ $# -ge 2 ] || { sed -n '2,5s/^# //p' "$0"; exit 2; }
processor=$1 root=$(realpath -m "$2")
targets=(solidtex_golden) tests=(-R golden:)
[ "${3:-}" = --hashes ] || targets+=(solidtex_unit solidtex_api_tests) tests=(-L engine)
case $processor in
  aarch64) debian=arm64 ;;
  s390x) debian=s390x ;;
  *) echo "error: processor $processor, expected aarch64 or s390x" >&2; exit 2 ;;
esac
triplet=$processor-linux-gnu

if [ ! -e "$root/ready" ]; then
  debootstrap --variant=minbase --include=cmake,ninja-build,pkg-config,python3,ccache,catch2,\
nlohmann-json3-dev,qemu-user-static bookworm "$root"
  touch "$root/ready"
fi
inside() { chroot "$root" env HOME=/root DEBIAN_FRONTEND=noninteractive "$@"; }
if ! inside dpkg --print-foreign-architectures | grep -qx $debian; then
  inside dpkg --add-architecture $debian
  inside apt-get update -q
fi
inside apt-get install -q -y --no-install-recommends g++-$processor-linux-gnu \
  libtbb-dev:$debian libhwy-dev:$debian

rm -rf "$root/solidtex"
mkdir -p "$root/solidtex"
git ls-files -z --cached | tar -c --null --ignore-failed-read -T - | tar -x -C "$root/solidtex"
inside cmake -S /solidtex -B /build-$processor -G Ninja -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_SYSTEM_NAME=Linux -DCMAKE_SYSTEM_PROCESSOR=$processor \
  -DCMAKE_C_COMPILER=$triplet-gcc -DCMAKE_CXX_COMPILER=$triplet-g++ \
  -DCMAKE_LIBRARY_ARCHITECTURE=$triplet \
  -DCMAKE_CROSSCOMPILING_EMULATOR=/usr/bin/qemu-$processor-static \
  -DSOLIDTEX_BUILD_RENDERER=OFF -DSOLIDTEX_BUILD_OPENIMAGEIO=OFF -DSOLIDTEX_BUILD_TOOLS=OFF \
  -DSOLIDTEX_BUILD_PYTHON=OFF
inside cmake --build /build-$processor --target "${targets[@]}"
inside ctest --test-dir /build-$processor --output-on-failure "${tests[@]}"
