#!/bin/sh
# Is every C++ file formatted as .clang-format says? Changes nothing. A few seconds.
# Ends with 77 (skipped) where clang-format or git is missing.
set -eu
cd "$(dirname "$0")/../.."
command -v clang-format >/dev/null || { echo "clang-format is not installed"; exit 77; }
git rev-parse --git-dir >/dev/null 2>&1 || { echo "not a clone of the repository"; exit 77; }
git ls-files -z '*.cc' '*.cpp' '*.h' | xargs -0 clang-format --dry-run -Werror
