#!/usr/bin/env python3
"""Are scenes of others as bright as their references say?

  tests/bench/scenes_of_others.py FOLDER [--time 30] [--scenes NAME,...] [--pictures DIR]

FOLDER holds a folder for each scene, with scene.pbrt or scene-v4.pbrt and the reference of another
renderer, reference.exr; those that are missing are named and left out. Each scene is rendered at
the size and depth of its reference for so many seconds by both cores, whatever else runs. Written
to docs/measurements/scenes-of-others.csv: the mean of each channel, clipped at 5, over that of the
reference; relMSE without the worst 0.1 % of pixels, with the reference's own noise beside it; the memory of
the largest process; and seconds of a whole command that renders one pass.
"""
import argparse
import csv
import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
LUCERNA = ROOT / "build/release/bin/lucerna"
# Size, depth and the reference's own squared noise (relMSE without the worst 0.1 % of pixels).
SCENES = {
    "cornell-box": ("256x256", 100, 1.5e-4), "veach-mis": ("256x144", 100, 1.5e-3),
    "water-caustic": ("256x256", 100, 2.8e-3), "veach-bidir": ("256x256", 20, 6.6e-4),
    "sphere-box": ("256x256", 100, 8.7e-5), "sphere-caustic": ("256x256", 33, 6.5e-6),
    "coffee": ("192x240", 17, 3.4e-3), "lamp": ("192x192", 7, 1.3e-3),
    "teapot-full": ("192x108", 65, 4.5e-3), "material-testball": ("192x108", 65, 1.1e-3),
    "staircase2": ("192x192", 65, 9.2e-3), "classroom": ("192x108", 17, 4.2e-2),
    "bedroom": ("192x108", 65, 4.5e-2), "veach-ajar": ("192x108", 13, 1.0e-1)}
COLUMNS = ["scene", "size", "depth", "red", "green", "blue", "relMSE trimmed",
           "relMSE trimmed, of the reference", "peak memory MB", "seconds to first pass"]


def run(*words):
    done = subprocess.run([LUCERNA, *map(str, words)], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(done.stderr)
    return done.stdout


def peak_memory_mb():
    """Of the largest process so far, this program's own children's children included."""
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024


def row_of(name, folder, seconds, pictures):
    size, depth, noise = SCENES[name]
    scene = next(folder.glob("scene*.pbrt"))
    with tempfile.TemporaryDirectory() as made:
        image = pathlib.Path(made) / "image.exr"
        given = ["render", scene, "--size", size, "--max-depth", depth, "-o", image, "--quiet"]
        start = time.monotonic()
        run(*given, "--passes", 1)
        first = time.monotonic() - start
        run(*given, "--time", seconds, "--png", pictures / f"{name}.png")
        diff = json.loads(run("diff", image, folder / "reference.exr", "--clip", 5, "--json"))
        error = json.loads(run("diff", image, folder / "reference.exr", "--json"))
    red, green, blue = (f"{ratio:.4f}" for ratio in diff["channel_mean_ratio"])
    return [name, size, depth, red, green, blue, f"{error['rel_mse_trimmed']:.2e}", f"{noise:.1e}",
            f"{peak_memory_mb():.0f}", f"{first:.2f}"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--time", type=float, default=30)
    parser.add_argument("--scenes", default="", help="names, by commas; empty: all")
    parser.add_argument("--pictures", type=pathlib.Path, default=ROOT / "build/scenes-of-others")
    parser.add_argument("--table", type=pathlib.Path,
                        default=ROOT / "docs/measurements/scenes-of-others.csv")
    arguments = parser.parse_args()
    arguments.pictures.mkdir(parents=True, exist_ok=True)
    os.environ.setdefault("GLIBC_TUNABLES", "glibc.malloc.hugetlb=1")
    rows = []
    for name in arguments.scenes.split(",") if arguments.scenes else SCENES:
        folder = arguments.folder / name
        if not (folder / "reference.exr").exists():
            print(f"{name}: {folder} has no reference.exr")
            continue
        # In a process of its own, whose children's memory is that of this scene alone.
        reading, writing = os.pipe()
        if os.fork() == 0:
            os.write(writing, json.dumps(
                row_of(name, folder, arguments.time, arguments.pictures)).encode())
            os._exit(0)
        os.close(writing)
        with os.fdopen(reading) as pipe:
            text = pipe.read()
        if not text or os.wait()[1] != 0:
            sys.exit(f"{name}: not measured")
        rows.append(json.loads(text))
        print(*rows[-1], flush=True)
    with arguments.table.open("w", newline="", encoding="utf-8") as file:
        file.write(f"# tests/bench/scenes_of_others.py FOLDER --time {arguments.time:g}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(rows)


if __name__ == "__main__":
    main()
