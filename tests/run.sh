#!/usr/bin/env bash
# Builds everything and runs every test, on a fresh Debian 12 machine too:
#   bash tests/run.sh [flags of ctest]
# Fails when anything fails. Tests that use the scenes beside the project are skipped, and say so,
# where those are absent.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
bash "$root/deploy/packages.sh" tests
cd "$root"
# Sources eight at a time: headers take most of a build from nothing. As many compilers as cores: more only take the
# cache from each other.
cmake --preset release -D LUCERNA_BUILD_TESTS=ON -D CMAKE_UNITY_BUILD=ON
cmake --build --preset release --parallel "$(nproc)"
# Twice as many as cores: many tests wait for processes and lines most of the time (see tests/CMakeLists.txt).
exec ctest --preset release --parallel "$((2 * $(nproc)))" "$@"
