#!/usr/bin/env bash
# From a fresh Debian 12 machine to an image, in one command:
#   bash deploy/run.sh [SCENE.pbrt] [flags of lucerna submit]
# Installs packages, builds, starts one coordinator and two workers on loopback, submits the scene,
# shows progress, and leaves out.exr and out.png in the current folder.
set -euo pipefail
here=$(pwd)
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

scene=$root/tests/scenes/caustic.pbrt
if [ $# -gt 0 ] && [ "${1#-}" = "$1" ]; then
  # Before anything is installed or built: the arguments are checked.
  if [ ! -f "$1" ]; then
    echo "$1: there is no such scene file" >&2
    exit 1
  fi
  scene=$(realpath -- "$1")
  shift
fi

bash "$root/deploy/packages.sh"
cd "$root"
cmake --preset release -D LUCERNA_BUILD_TESTS=OFF -D CMAKE_UNITY_BUILD=ON >/dev/null
cmake --build --preset release --parallel "$(nproc)" --target lucerna lucerna-server lucerna-worker
bin=$root/build/release/bin
cd "$here"

# Memory in huge pages (docs/deploy.md).
export GLIBC_TUNABLES=${GLIBC_TUNABLES:-glibc.malloc.hugetlb=1}

logs=$(mktemp --directory)
processes=()
stop() {
  for process in "${processes[@]}"; do kill -TERM "$process" 2>/dev/null || true; done
  wait || true
  rm --recursive --force "$logs"
}
trap stop EXIT

"$bin/lucerna-server" --listen 127.0.0.1:0 >"$logs/server.address" 2>"$logs/server.log" &
processes+=($!)
for _ in $(seq 100); do
  address=$(sed --quiet 's/^listening on //p' "$logs/server.address")
  [ -n "$address" ] && break
  kill -0 "${processes[0]}" 2>/dev/null || break
  sleep 0.1
done
if [ -z "${address:-}" ]; then
  echo "the coordinator did not start:" >&2
  cat "$logs/server.log" >&2
  exit 1
fi
threads=$(((($(nproc) + 1)) / 2))
for worker in 1 2; do
  "$bin/lucerna-worker" --server "$address" --threads "$threads" 2>"$logs/worker$worker.log" &
  processes+=($!)
done
echo "coordinator on $address, two workers with $threads thread(s) each"

"$bin/lucerna" submit "$scene" --server "$address" -o out.exr --png out.png "$@"
echo "the image is $here/out.png; lucerna and its programs are in $bin"
