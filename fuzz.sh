#!/usr/bin/env bash
# Builds the fuzz targets with clang's libFuzzer, AddressSanitizer and UndefinedBehaviorSanitizer
# into build-fuzz/, and runs each of them.
#   ./fuzz.sh [SECONDS [TARGET...]]     seconds of each target: 60
# As many targets run at a time as there are cores. SOLIDTEX_FUZZ_SEED=N repeats the inputs of a run
# from the same corpus, as CI does; by default each run makes others.
# New inputs are kept in build-fuzz/corpus/TARGET, so that the next run goes on from them. An input
# that fails is kept in build-fuzz/found/TARGET: mend the reader, and move the input to
# tests/fuzz/corpus/TARGET, where it is a test of every build. Exit code: 1 if an input failed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
seconds=${1:-60}
[[ $seconds =~ ^[0-9]+$ ]] || { echo "fuzz.sh: found '$seconds', expected seconds" >&2; exit 2; }
shift || true

source setup/common.sh
install_debian_packages setup/debian-fuzz.txt
# Readers are attacked, not kernels: one instruction set of them is enough.
cmake -S . -B build-fuzz -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DSOLIDTEX_FUZZ=ON \
  -DCMAKE_CXX_FLAGS=-DHWY_COMPILE_ONLY_STATIC -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ \
  -DSOLIDTEX_BUILD_PYTHON=OFF -DSOLIDTEX_SANITIZE=fuzzer-no-link,address,undefined >build-fuzz.log ||
  { cat build-fuzz.log; exit 1; }
mv build-fuzz.log build-fuzz/configure.log
targets=("$@")
[ "${#targets[@]}" -gt 0 ] ||
  mapfile -t targets < <(cd tests/fuzz/corpus && printf '%s\n' *)
cmake --build build-fuzz --parallel "$(build_jobs)" --target "${targets[@]/#/fuzz_}"

fuzz() {  # becomes the target $1
  mkdir -p "build-fuzz/corpus/$1" "build-fuzz/found/$1"
  local options=(-max_total_time="$seconds" -timeout=25 -rss_limit_mb=4096 -max_len=65536
                 -seed="${SOLIDTEX_FUZZ_SEED:-0}" -print_final_stats=1
                 -artifact_prefix="build-fuzz/found/$1/")
  # OpenImageIO 2.4 leaks its message about a PNG that ends early.
  export ASAN_OPTIONS=detect_leaks=$([ "$1" = image ] && echo 0 || echo 1)
  [ ! -e "tests/fuzz/$1.dict" ] || options+=(-dict="tests/fuzz/$1.dict")
  exec "build-fuzz/bin/fuzz_$1" "${options[@]}" "build-fuzz/corpus/$1" "tests/fuzz/corpus/$1" \
    >"build-fuzz/$1.log" 2>&1
}

say "${#targets[@]} targets, $seconds seconds each, $(build_jobs) at a time"
declare -A started
trap 'kill $(jobs -rp) 2>/dev/null || true' EXIT  # Ctrl-C
export UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1
for target in "${targets[@]}"; do
  while [ "$(jobs -rp | wc -l)" -ge "$(build_jobs)" ]; do wait -n || true; done
  fuzz "$target" &
  started[$target]=$!
done
failed=()
for target in "${targets[@]}"; do
  wait "${started[$target]}" || failed+=("$target")
  say "$target"
  grep -E "stat::number_of_executed_units|ERROR|SUMMARY" "build-fuzz/$target.log" || true
  grep -E " cov: " "build-fuzz/$target.log" | tail -n 1 || true
done
[ "${#failed[@]}" -eq 0 ] || fail "inputs failed: ${failed[*]}; see build-fuzz/found/ and the logs"
