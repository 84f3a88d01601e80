#!/usr/bin/env bash
# Builds the image of deploy/container from a package that is there already, and renders in it: coordinator, two workers (one
# killed in the middle) and client in containers of their own. The image must be that of `lucerna render` outside.
#   try_container.sh BASE PACKAGE BIN
# BASE: an image of Debian 12 that podman has; PACKAGE: a .deb below the repository, made by cpack of BIN's build. Needs podman
# and the packages of Debian; 77 without podman.
set -euo pipefail
base=$1 package=$2 bin=$(realpath "$3")
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
command -v podman > /dev/null || { echo "podman is not installed: the container was not tried"; exit 77; }
podman image exists "$base" || { echo "podman has no image $base: the container was not tried"; exit 77; }
cd "$root"
tag=lucerna:try
folder=$(mktemp -d)
chmod 777 "$folder"
started=()
cleanup() {
  code=$?
  for container in "${started[@]}"; do podman rm --force --time 10 "$container" > /dev/null 2>&1 || true; done
  if [ "$code" = 0 ]; then rm -rf "$folder"; else echo "kept: $folder"; fi
}
trap cleanup EXIT
podman build --network host --tag "$tag" --file deploy/container/Containerfile \
  --build-arg BASE="$base" --build-arg PACKAGE="$(realpath --relative-to=. "$package")" . > "$folder/build.log" 2>&1 ||
  { tail -n 20 "$folder/build.log"; exit 1; }

in_background() { started+=("$(podman run --detach --network host --volume "$folder:/scenes" "$tag" "$@")"); }
[ "$(podman run --rm --network host "$tag" id --user)" = 10001 ] || { echo "the programs run as another user"; exit 1; }
in_background lucerna-server --listen 127.0.0.1:0 --state /var/lib/lucerna
address=
for _ in $(seq 100); do
  address=$(podman logs "${started[0]}" 2> /dev/null | sed -n 's/^listening on //p')
  [ -n "$address" ] && break
  sleep 0.1
done
[ -n "$address" ] || { podman logs "${started[0]}"; exit 1; }
in_background lucerna-worker --server "$address" --threads 1
in_background lucerna-worker --server "$address" --threads 1
cp -r tests/scenes/caustic.pbrt tests/scenes/meshes "$folder"
flags=(--size 96x96 --passes 256 --quiet)
podman run --rm --network host --volume "$folder:/scenes" "$tag" \
  lucerna submit /scenes/caustic.pbrt "${flags[@]}" --server "$address" -o /scenes/inside.exr &
client=$!
for _ in $(seq 300); do
  passes=$("$bin/lucerna" jobs --server "$address" --json | grep -o '"passes": [0-9]*' | grep -o '[0-9]*' | tail -n 1 || true)
  [ "${passes:-0}" -gt 0 ] && break
  sleep 0.1
done
kill -0 "$client" || { echo "the job ended before a worker could be killed"; exit 1; }
podman kill "${started[1]}" > /dev/null
wait "$client"
"$bin/lucerna" render tests/scenes/caustic.pbrt "${flags[@]}" -o "$folder/outside.exr"
inside=$("$bin/lucerna" digest "$folder/inside.exr")
outside=$("$bin/lucerna" digest "$folder/outside.exr")
echo "inside  $inside"
echo "outside $outside"
[ "${inside%% *}" = "${outside%% *}" ] || { echo "the images differ"; exit 1; }
# In order: the coordinator keeps its jobs and leaves.
podman stop --time 20 "${started[0]}" > /dev/null
[ "$(podman inspect --format '{{.State.ExitCode}}' "${started[0]}")" = 0 ] || { echo "the coordinator did not end in order"; exit 1; }
