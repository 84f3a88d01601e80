#!/bin/sh
# Proves that .clang-tidy still switches on what we rely on. A stray comma or comment can turn a
# whole family off without a word.
set -eu
cd "$(dirname "$0")/../.."
live=$(clang-tidy --list-checks -- 2>/dev/null)
for check in bugprone-argument-comment bugprone-use-after-move cppcoreguidelines-slicing \
             google-explicit-constructor misc-unused-parameters modernize-use-override \
             performance-for-range-copy readability-identifier-naming readability-redundant-control-flow; do
  echo "$live" | grep -q " $check\$" || { echo "not live: $check"; exit 1; }
done
