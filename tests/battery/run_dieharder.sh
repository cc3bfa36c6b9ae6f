#!/usr/bin/env bash
# Feeds one stream to dieharder and checks the verdict.
#   run_dieharder.sh NOISE_STREAM passes|fails SCHEME ORDER all|TEST,TEST...
# The streams are fixed, so the outcome is too. "passes": no test fails (dieharder: p < 10^-6, or
# beyond 1 - 10^-6); "fails": at least one does.
set -euo pipefail
noise_stream=$1 verdict=$2 scheme=$3 order=$4 tests=$5

judge() {  # the generator ends with a broken pipe when dieharder has seen enough
  { "$noise_stream" words "$scheme" "$order" 0 || true; } | dieharder -g 200 -S 1 "$@"
}

if [ "$tests" = all ]; then
  results=$(judge -a)
else
  results=""
  for test in ${tests//,/ }; do results+=$(judge -d "$test")$'\n'; done
fi
grep -E 'PASSED|WEAK|FAILED' <<<"$results" || { echo "dieharder gave no verdict"; exit 2; }
failures=$(grep -c FAILED <<<"$results" || true)
echo "$scheme along $order: $failures failed, expected verdict: $verdict"
if [ "$verdict" = passes ]; then [ "$failures" -eq 0 ]; else [ "$failures" -gt 0 ]; fi
