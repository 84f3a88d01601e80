#!/bin/sh
# Proves that .clang-tidy still switches on what we rely on. A stray comma or comment can turn a
# whole family off without a word.
set -eu
cd "$(dirname "$0")/../.."
live=$(clang-tidy --list-checks -- 2>/dev/null)
for check in bugprone-use-after-move clang-analyzer-core.NullDereference \
             concurrency-thread-canceltype-asynchronous cppcoreguidelines-slicing \
             google-explicit-constructor misc-unused-parameters modernize-use-nodiscard \
             performance-unnecessary-value-param readability-identifier-naming; do
  echo "$live" | grep -q " $check\$" || { echo "not live: $check"; exit 1; }
done
