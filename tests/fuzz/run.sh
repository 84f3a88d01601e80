#!/usr/bin/env bash
# Runs fuzz programs from their seeds, the bad files of tests/fuzz/corpus and what was found before:
#   cmake --preset fuzz && cmake --build --preset fuzz
#   tests/fuzz/run.sh FOLDER EXECUTIONS [TARGET...]
# FOLDER/TARGET collects inputs, FOLDER/TARGET.log is libFuzzer's log, and FOLDER/TARGET-* are the
# inputs that failed. Targets run one after another; fails when one finds something.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
folder=$(realpath "$1")
executions=$2
shift 2
targets=("$@")
if [ ${#targets[@]} -eq 0 ]; then
  targets=(pbrt gltf mitsuba obj ply view sensors measured image accumulation block radii guide slice checkpoint sums record manifest messages)
fi
failed=0
for target in "${targets[@]}"; do
  program="$root/build/fuzz/tests/fuzz_$target"
  most_bytes=512
  case $target in
    gltf) most_bytes=8192 ;;
    pbrt | mitsuba | obj | ply | measured | image | sums) most_bytes=4096 ;;
  esac
  mkdir -p "$folder/$target"
  "$program" "--write-seeds=$folder/$target"
  given=("$folder/$target")
  for more in "$root/tests/fuzz/corpus/$target" "$root/tests/fuzz/corpus/found/$target"; do
    if [ -d "$more" ]; then given+=("$more"); fi
  done
  dictionary=()
  if [ -f "$root/tests/fuzz/$target.dict" ]; then dictionary=("-dict=$root/tests/fuzz/$target.dict"); fi
  "$program" -runs="$executions" -max_len=$most_bytes -timeout=20 -rss_limit_mb=2048 \
    -print_final_stats=1 "${dictionary[@]}" -artifact_prefix="$folder/$target-" "${given[@]}" \
    >"$folder/$target.log" 2>&1 || failed=1
  grep -H "stat::number_of_executed_units\|ERROR\|SUMMARY\|runtime error" "$folder/$target.log" || true
done
exit $failed
