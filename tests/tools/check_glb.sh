#!/usr/bin/env bash
# Is what `lucerna bake` writes good glTF, and does a viewer show it?
#
#   bash tests/tools/check_glb.sh PICTURE.png [SCENE [FLAGS...]]
#
# Bakes a scene (default: tests/scenes/office.pbrt), lets the validator of Khronos check the .glb
# (npm package gltf-validator: no errors, no warnings), loads it with three.js in headless Chromium
# and writes what that shows to PICTURE.png, to be looked at. The npm packages are fetched into a
# temporary folder, or into $LUCERNA_NPM if that is set. Exits with 77 and says so where node, npm or
# chromium are absent or the packages cannot be fetched.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
bin=${LUCERNA_BIN:-$root/build/release/bin}
picture=$(realpath -m "${1:?name a file for the picture}")
scene=$(realpath "${2:-$root/tests/scenes/office.pbrt}")
shift $(($# < 2 ? $# : 2))

for program in node npm chromium python3; do
  if ! command -v "$program" >/dev/null; then
    echo "skipped: $program is not installed"
    exit 77
  fi
done
folder=$(mktemp -d)
server=
finish() {
  if [ -n "$server" ]; then kill "$server" 2>/dev/null || true; fi
  rm -rf "$folder"
}
trap finish EXIT
packages=${LUCERNA_NPM:-$folder/packages}
if [ ! -d "$packages/node_modules/three" ]; then
  mkdir -p "$packages"
  if ! (cd "$packages" && npm install --no-audit --no-fund --silent \
        gltf-validator@2.0.0-dev.3.10 three@0.160.0 >/dev/null 2>&1); then
    echo "skipped: npm cannot fetch gltf-validator and three"
    exit 77
  fi
fi
ln -s "$packages/node_modules" "$folder/node_modules"
cp "$root/tests/tools/glb/validate.js" "$root/tests/tools/glb/page.html" "$folder"

"$bin/lucerna" bake "$scene" -o "$folder/mesh.glb" --quiet --passes 16 "$@"
(cd "$folder" && node validate.js mesh.glb)

(cd "$folder" && exec python3 -u -m http.server --bind 127.0.0.1 0 >server.log 2>&1) &
server=$!
until port=$(grep -o 'port [0-9]*' "$folder/server.log" 2>/dev/null | grep -o '[0-9]*$'); do
  kill -0 "$server"
done
show() {
  # Chromium's own software renderer; without a sandbox it runs as root too.
  chromium --headless --no-sandbox --disable-dev-shm-usage --user-data-dir="$folder/profile" \
    --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --hide-scrollbars \
    --window-size=800,600 --virtual-time-budget=20000 "$@" \
    "http://127.0.0.1:$port/page.html" 2>"$folder/chromium.log"
}
result=$(show --dump-dom | grep -o 'data-result="[^"]*"' | cut -d'"' -f2)
echo "three.js: ${result:-the page said nothing}"
show --screenshot="$picture" >/dev/null
case $result in
  0\ *|failed*|"") exit 1 ;;
esac
echo "look at $picture"
