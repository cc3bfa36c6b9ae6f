#!/usr/bin/env bash
# Builds ktx2check, the validator of Khronos for .ktx2, for the tests: setup/ktx2check.sh build
# No registry has the program. The crate libktx-rs-sys brings its source, KTX-Software 4.0.
set -euo pipefail

folder=$(realpath "${1:?expected the folder of the build}")/ktx
mkdir -p "$folder/crate"
cd "$folder/crate"
[ -f Cargo.toml ] || cargo init --quiet --vcs none --name ktx
cargo add --quiet libktx-rs-sys@0.3.3
cargo vendor --quiet vendor > /dev/null
source=vendor/libktx-rs-sys/build/KTX-Software
printf '#!/bin/sh\n' > "$source/mkversion" # the crate has no history to make a version from
chmod +x "$source/mkversion"
cmake -S "$source" -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=Debug -DKTX_FEATURE_TESTS=OFF \
  -DKTX_FEATURE_GL_UPLOAD=OFF -DKTX_FEATURE_VULKAN=OFF
cmake --build "$folder" --target ktx2check
