#!/bin/sh
# Runs clang-tidy with the short list of .clang-tidy.
#
# Usage: check_tidy.sh BUILD_FOLDER [SOURCE...]  (the folder holds compile_commands.json)
#
# Without sources: those of the product that the last 20 commits changed, the most changed first, at most 16.
# The whole product takes some 15 minutes on two cores, most of it in the headers of gRPC, and what did
# not change was checked when it did. For everything:
#   check_tidy.sh build/release $(git ls-files 'render/*.cc' 'server/*.cc' 'worker/*.cc' 'client/*.cc')
# Ends with 77 (skipped) where clang-tidy or the history is missing.
set -eu
build=$(cd "$1" && pwd)
shift
cd "$(dirname "$0")/../.."
command -v clang-tidy >/dev/null || { echo "clang-tidy is not installed"; exit 77; }
sh tests/tools/check_tidy_config.sh

if [ $# -eq 0 ]; then
  git rev-parse --quiet --verify HEAD >/dev/null 2>&1 || { echo "not a clone of the repository"; exit 77; }
  # A shallow clone has fewer commits.
  base=$(git rev-list --first-parent --max-count=21 HEAD | tail -n 1)
  set -- $(git diff --numstat --diff-filter=d --no-renames "$base" -- \
             'render/*.cc' 'server/*.cc' 'worker/*.cc' 'client/*.cc' |
           awk '{print $1 + $2, $3}' | sort -k1,1nr -k2 | head -n 16 | cut -d' ' -f2)
fi
[ $# -gt 0 ] || { echo "no file to check"; exit 0; }

# clang reads neither g++'s precompiled headers nor some of its warning flags.
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
sed -E 's/ -Winvalid-pch| -fpch-preprocess| -include [^ ]*cmake_pch\.hxx//g;
        s/ -Wno-(restrict|stringop-overflow|array-bounds)//g' \
  "$build/compile_commands.json" > "$scratch/compile_commands.json"
printf '%s\n' "$@" | xargs -P "$(nproc)" -n 1 clang-tidy -p "$scratch" --quiet
