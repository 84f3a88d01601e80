#!/usr/bin/env bash
# Which bits do the programs in a folder render? Prints one line for each of 78 small renders: all
# scenes of the project, all controllers and kernels, and several workers and threads.
#   tests/tools/image_digests.sh [FOLDER WITH PROGRAMS] > after.txt; diff before.txt after.txt
# A change of structure leaves every line as it was.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
bin=${1:-$root/build/release/bin}
scenes=$root/tests/scenes
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# digest_of SCENE [FLAGS OF lucerna render]
digest_of() {
  local name=$1
  shift
  if "$bin/lucerna" render "$scenes/$name.pbrt" --size 48x36 --passes 6 --seed 5 --quiet \
      -o "$folder/image.exr" "$@" > /dev/null; then
    echo "$name $* $("$bin/lucerna" digest "$folder/image.exr")"
  else
    echo "$name $* failed"
  fi
}

for path in "$scenes"/*.pbrt; do
  name=$(basename "$path" .pbrt)
  digest_of "$name"
  digest_of "$name" --radius-controller frequency-mse --frequency-share 0.2
done
for name in caustic glass-box corner; do
  for controller in ppm pppm appm cppm frequency frequency-consistent frequency-mse; do
    digest_of "$name" --radius-controller "$controller"
  done
done
for name in lamp-in-glass textured; do
  for kernel in constant epanechnikov biweight gaussian; do
    digest_of "$name" --kernel "$kernel"
  done
done
digest_of water-sun --workers 1 --threads 1
digest_of water-sun --workers 1 --threads 2
digest_of water-sun --workers 3 --threads 1
digest_of water-sun --workers 2 --threads 2
digest_of glass-box --use-everything
