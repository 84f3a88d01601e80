#!/usr/bin/env python3
"""How much nearer to the truth are denoised images, and is the error that is said of them true?

Usage: tests/bench/denoise.py [--bin DIR] [--passes 16,128] [--seeds 7] [--study DIR] [-o TABLE.csv]

Renders the scenes that have references in tests/bench/references with 128 x 128 pixels and a photon
for each, and prints a line for each: relative errors (the root of relMSE without the worst 0.1 % of
pixels, the reference's noise taken off), before and after. Scenes of half B are those that
tests/tools/make_study_scenes.py writes to the folder of --study; without it they are left out.
"""

import argparse
import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def run(*command):
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def measure(program, scene, reference, passes, seed):
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "out.exr"
        job = run(program, "render", scene, "--size", "128x128", "--photons-per-pass", "16384",
                  "--passes", str(passes), "--seed", str(seed), "--denoise", "--reference",
                  reference, "-o", out, "--json", "--quiet")
        noise = run(program, "diff", out, reference, "--json")
    noise_kept = noise.get("reference_rel_mse_trimmed") or 0
    before, after = job["relative_error"], job["denoised_error"]

    def true(error):
        return math.sqrt(max(error["true"] ** 2 - noise_kept, 1e-12))

    return {"scene": scene.stem, "passes": passes, "seed": seed,
            "image": true(before), "denoised": true(after),
            "squared_ratio": (true(after) / true(before)) ** 2,
            "image_estimate_over_true": before["estimate"] / true(before),
            "denoised_estimate_over_true": after["estimate"] / true(after),
            "inside": int(after["low"] <= true(after) <= after["high"])}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", default=ROOT / "build/release/bin", type=pathlib.Path)
    parser.add_argument("--passes", default="16,128")
    parser.add_argument("--seeds", default="7")
    parser.add_argument("--study", type=pathlib.Path)
    parser.add_argument("-o", dest="table", type=pathlib.Path)
    arguments = parser.parse_args()
    rows = []
    for reference in sorted((ROOT / "tests/bench/references").glob("*.exr")):
        scene = ROOT / f"tests/scenes/{reference.stem}.pbrt"
        if not scene.exists():
            if arguments.study is None:
                continue
            scene = arguments.study / f"{reference.stem}.pbrt"
        for passes in map(int, arguments.passes.split(",")):
            for seed in map(int, arguments.seeds.split(",")):
                row = measure(arguments.bin / "lucerna", scene, reference, passes, seed)
                rows.append(row)
                print(*(f"{value:.4g}" if isinstance(value, float) else value
                        for value in row.values()), flush=True)
    for passes in sorted({row["passes"] for row in rows}):
        part = [row for row in rows if row["passes"] == passes]
        gain = math.exp(sum(math.log(row["squared_ratio"]) for row in part) / len(part))
        near = sum(0.8 <= row["denoised_estimate_over_true"] <= 1.25 for row in part)
        print(f"{passes} passes: squared error {gain:.3f} of the image's (geometric mean), "
              f"{sum(row['inside'] for row in part)} of {len(part)} within the interval, "
              f"{near} estimates within 0.8 to 1.25")
    if arguments.table:
        with arguments.table.open("w", newline="") as file:
            writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
            writer.writeheader()
            writer.writerows({key: f"{value:.4g}" if isinstance(value, float) else value
                              for key, value in row.items()} for row in rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
