#!/usr/bin/env python3
"""How near are photon paths to the rate at which Embree alone traces their rays, and what lies between?

Usage: tests/bench/roofline.py SCENE... [--bin DIR] [--repeat 100] [-o TABLE.csv]

For each scene, on one thread: photon paths a second, as a share of what tracing the same rays alone
allows (medians of 7, interleaved); instructions, data references and cache misses a ray, as
`valgrind --tool=cachegrind` (package valgrind) simulates them with the caches of this machine; and which part of the
program the instructions belong to. Of two runs that differ by --repeat repetitions the difference
counts, so that reading the scene and building its tree do not. Where `perf stat` has counters (`perf
stat -e cycles true`), cycles are the better measure; virtual machines seldom have them.
"""

import argparse
import collections
import csv
import json
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
KINDS = ("photon_rays", "photon_paths")
COUNTS = {"instructions": r"I +refs: +([\d,]+)", "data_references": r"D +refs: +([\d,]+)",
          "misses_of_first_cache": r"D1 +misses: +([\d,]+)",
          "misses_of_last_cache": r"LLd misses: +([\d,]+)"}
# Parts of the program by what the names of their functions contain; the first that fits counts.
# Embree's library has no names.
PARTS = (("Embree", ("???",)),
         ("shapes and hits", ("Intersect", "SurfaceAt", "Point(", "ShadingFrame", "Offset",
                              "LeavingPoint", "SafeOrigin")),
         ("scattering", ("Bsdf", "Dielectric", "Metal", "Fresnel", "Microfacet", "Material")),
         ("emission", ("Emission", "Emit", "SampleFace", "LightSet", "Guide")),
         ("random numbers", ("Rng", "KeyOf", "Sobol", "Philox")),
         ("functions of C", ("sincos", "__sin", "__cos", "__exp", "__log", "__pow", "mem", "alloc")),
         ("walk and deposits", ("Walk<", "PhotonPath", "Deposit", "Frame", "Energy")))


def rates(bench, scene):
    """Paths a second by kind, and rays a path."""
    ran = subprocess.run(
        [bench, "--benchmark_filter=^(" + "|".join(KINDS) + ")/", "--benchmark_repetitions=7",
         "--benchmark_enable_random_interleaving=true", "--benchmark_format=json", scene],
        check=True, capture_output=True, text=True).stdout
    found = {}
    for row in json.loads(ran[ran.index("{"):])["benchmarks"]:
        kind, _, _ = row["name"].partition("/")
        if not row["name"].endswith("_median"):
            continue
        paths = next(row[key] for key in ("photon_paths/s", "paths_ceiling/s", "eye_paths/s")
                     if row.get(key))
        found[kind] = (float(paths), float(row.get("rays/path") or 0))
    # The ceiling traces the rays of the photon paths.
    found["photon_rays"] = (found["photon_rays"][0], found["photon_paths"][1])
    return found


def counted(bench, scene, repetitions):
    """Counts of a run of photon_paths with so many repetitions, of one iteration each, and
    instructions by part."""
    with tempfile.TemporaryDirectory() as folder:
        ran = subprocess.run(
            ["valgrind", "--tool=cachegrind", "--cache-sim=yes",
             f"--cachegrind-out-file={folder}/out", bench, "--benchmark_filter=^photon_paths/",
             "--benchmark_min_time=0.000001", f"--benchmark_repetitions={repetitions}", scene],
            check=True, capture_output=True, text=True)
        parts = collections.Counter()
        part = "others"
        with open(f"{folder}/out", errors="replace") as file:
            for line in file:
                if line.startswith("fn="):
                    part = next((name for name, marks in PARTS
                                 if any(mark in line for mark in marks)), "others")
                elif line[0].isdigit():
                    parts[part] += int(line.split()[1])
    return {name: int(re.search(pattern, ran.stderr)[1].replace(",", ""))
            for name, pattern in COUNTS.items()}, parts


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="+", type=pathlib.Path)
    parser.add_argument("--bin", default=ROOT / "build/release/bin", type=pathlib.Path)
    parser.add_argument("--repeat", default=100, type=int)
    parser.add_argument("-o", dest="table", type=pathlib.Path)
    arguments = parser.parse_args()
    bench = arguments.bin / "lucerna-bench"
    # Paths of one iteration, as tests/bench/estimator_bench.cc has them.
    text = (ROOT / "tests/bench/estimator_bench.cc").read_text()
    photons = int(re.search(r"kPathsAtOnce = (\d+)", text)[1])
    rows = []
    for scene in map(pathlib.Path.resolve, arguments.scenes):
        rate = rates(bench, scene)
        paths_per_second, rays = rate["photon_paths"]
        (few, few_parts), (many, many_parts) = (
            counted(bench, scene, repetitions) for repetitions in (1, 1 + arguments.repeat))
        row = {"scene": scene.parent.name if scene.stem.startswith("scene") else scene.stem, "paths/s": paths_per_second, "rays/path": rays,
               "of_ceiling": paths_per_second / rate["photon_rays"][0]}
        for name in COUNTS:
            row[name + "/ray"] = (many[name] - few[name]) / arguments.repeat / photons / rays
        row["instructions/s"] = row["instructions/ray"] * rays * paths_per_second
        difference = {name: many_parts[name] - few_parts[name]
                      for name in [name for name, _ in PARTS] + ["others"]}
        for name, instructions in difference.items():
            row["share of " + name] = instructions / sum(difference.values())
        rows.append(row)
        print(*(f"{name} {value:.4g}" if isinstance(value, float) else value
                for name, value in row.items()), flush=True)
    if arguments.table:
        with arguments.table.open("w", newline="") as file:
            writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
            writer.writeheader()
            writer.writerows({key: f"{value:.4g}" if isinstance(value, float) else value
                              for key, value in row.items()} for row in rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
