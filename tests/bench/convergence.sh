#!/usr/bin/env bash
# Writes docs/convergence.md: how error falls with time on the project's scenes.
#
#   bash tests/bench/convergence.sh [seconds of a reference] [repetitions]
#
# Needs build/release/bin and an idle machine; about two minutes a scene.
set -euo pipefail
cd "$(dirname "$0")/../.."

reference_s=${1:-60}
repetitions=${2:-2}
times=0.5,1,2,3
scenes=(penumbra hard-shadow corner caustic glass-sphere glass-box lamp-in-glass)
size=128x128
lucerna=build/release/bin/lucerna
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
mkdir -p docs/convergence

settings=(
  --settings "ppm: --radius-controller ppm"
  --settings "pppm: --radius-controller pppm"
  --settings "fixed: --radius-controller pppm --alpha 0.999 --initial-radius 1px"
  --settings "appm: --radius-controller appm"
  --settings "cppm: --radius-controller cppm"
  --settings "frequency: --radius-controller frequency"
  --settings "frequency-mse: --radius-controller frequency-mse"
)

page=$scratch/convergence.md
cat > "$page" <<'PAGE'
# How the error falls

Made by `bash tests/bench/convergence.sh`: for every scene a reference by `lucerna reference`, and
`lucerna compare` with seven settings in turn, several repetitions, errors after equal processor
time. relMSE is the mean of error² / (value² + floor) without the worst 0.1 % of pixels; the floor is
0.01 times the squared mean luminance of the reference without its brightest 1 % of lit pixels. The
reference's own noise is subtracted.

What theory says. With `ppm` and alpha 2/3 the squared error falls as n^-2/3, variance and squared
bias alike. A fixed radius has a variance that falls as n^-1 until its bias is all that is left;
`fixed` holds one pixel's width. The frequency controllers shrink as `ppm` does until the light's
bandwidth says that the radius is small enough, and hold it from there: n^-1 in the end. `appm`
aims at n^-2/3 with a better constant. In the first seconds radii are still on their way from where
they began, and the slopes are those of what prevails, noise or bias. Photons of the sun (glass-sphere)
are spread so evenly that wide kernels have hardly any noise; radii that shrink without need lose that, and
the error stands still until they are back where chance rules.

PAGE
for scene in "${scenes[@]}"; do
  echo "$scene" >&2
  # Half a pixel catches too few photons of this caustic in a minute.
  radius=0.5px
  if [[ $scene == glass-sphere ]]; then radius=2px; fi
  "$lucerna" reference "tests/scenes/$scene.pbrt" --size "$size" --max-depth 12 --quiet \
    --initial-radius "$radius" -o "$scratch/reference.exr" --time "$reference_s"
  "$lucerna" compare "tests/scenes/$scene.pbrt" --reference "$scratch/reference.exr" \
    --size "$size" --max-depth 12 --times "$times" --repetitions "$repetitions" --quiet \
    "${settings[@]}" -o "$scratch/table.md" --plot "docs/convergence/$scene.svg"
  # Names of scratch files say nothing to a reader.
  sed -e "s#$scratch/reference.exr#a reference of $reference_s s#g" -e "s/^# /## /" "$scratch/table.md" >> "$page"
  printf '\n![Squared error against time on %s](convergence/%s.svg)\n\n' "$scene" "$scene" >> "$page"
done
mv "$page" docs/convergence.md
