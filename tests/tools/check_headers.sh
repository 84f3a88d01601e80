#!/bin/sh
# Does every header compile alone? One that leans on what its includer happens to have included
# breaks at the next reordering.
#
# Usage: check_headers.sh BUILD_FOLDER  (for the generated Protobuf headers)
set -eu
generated=$(cd "$1" && pwd)/generated
cd "$(dirname "$0")/../.."
failed=0
for header in $(find render server worker client tests -name '*.h' ! -name '*_inl.h' | sort); do
  if ! echo "#include \"$header\"" | "${CXX:-g++}" -std=c++20 -march=x86-64-v3 -fsyntax-only \
      -I. -isystem "$generated" -x c++ -; then
    echo "does not compile alone: $header"
    failed=1
  fi
done
exit $failed
