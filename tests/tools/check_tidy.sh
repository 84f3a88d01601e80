#!/bin/sh
# Runs clang-tidy with the short list of .clang-tidy.
#
# Usage: check_tidy.sh BUILD_FOLDER [SOURCE...]  (the folder holds compile_commands.json)
#
# Without sources: those of tests/tools/tidy_files.txt, some of every floor that take a few seconds each. The list
# is fixed, so a commit can only fail for a file, or a header, that it changed. The whole product takes some 15 minutes
# on two cores, most of it in the headers of gRPC, and sources that include server/batch.h cannot join the list: clang-tidy 14
# takes the 0 in a defaulted <=> for a null pointer.
# Everything:
#   check_tidy.sh build/release $(git ls-files 'render/*.cc' 'server/*.cc' 'worker/*.cc' 'client/*.cc')
# Ends with 77 (skipped) where clang-tidy is missing.
set -eu
build=$(cd "$1" && pwd)
shift
cd "$(dirname "$0")/../.."
command -v clang-tidy >/dev/null || { echo "clang-tidy is not installed"; exit 77; }
sh tests/tools/check_tidy_config.sh

if [ $# -eq 0 ]; then
  set -- $(cat tests/tools/tidy_files.txt)
  for source in "$@"; do
    [ -f "$source" ] || { echo "tests/tools/tidy_files.txt: no file $source"; exit 1; }
  done
fi

# clang reads neither g++'s precompiled headers nor some of its warning flags.
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
python3 tests/tools/compile_commands.py "$build" | sed -E 's/ -Winvalid-pch| -fpch-preprocess| -include [^ ]*cmake_pch\.hxx//g;
        s/ -Wno-(restrict|stringop-overflow|stringop-overread|array-bounds|subobject-linkage)//g' > "$scratch/compile_commands.json"
printf '%s\n' "$@" | xargs -P "$(nproc)" -n 1 clang-tidy -p "$scratch" --quiet
