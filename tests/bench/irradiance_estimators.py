#!/usr/bin/env python3
"""How does the error of irradiance by photons fall, for three families of estimators, against
photons and against time?

  tests/bench/irradiance_estimators.py [SCENE ...] [--docs FOLDER]

On four scenes of tests/scenes `lucerna bake --indirect-only` measures the same surfaces with 2^14 to
2^20 photons, by histograms (buckets as wide as n^(-1/4)), the k nearest photons, kernels of a width
of n^(-1/6), and by the radius controllers appm, ppm and frequency-mse as choosers of the width. The
truth is a kernel estimate by `ppm` with 2^25 other photons and a quarter of the width. Errors are mean
squared differences at the vertices of one mesh over the squared mean irradiance. Widths begin, for
2^14 photons, with a 24th of the surfaces' diagonal.

Writes irradiance-estimators.csv and .svg to the folder (default: docs/measurements), with the slope
of the error against the number of photons: by theory -1/2 for histograms and -2/3 for the others,
where irradiance is smooth; and the error against the processor time of coordinator and workers, which others
who use the machine change little.
"""
import argparse
import csv
import json
import math
import pathlib
import struct
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = ROOT / "build/release/bin"
sys.path.insert(0, str(ROOT / "tests/bench"))
from irradiance_meshes import Interpolation, diagonal_of, read_ply  # pylint: disable=wrong-import-position

SCENES = ["corner", "glass-sphere", "cardioid", "water-lamp"]
PHOTONS = [1 << 14, 1 << 16, 1 << 18, 1 << 20]
PHOTONS_PER_PASS = 1 << 12
MESH_EDGES = 40  # of the diagonal


def bake(scene, out, flags):
    """Vertices, faces, and seconds of processor time of the round."""
    done = subprocess.run([BIN / "lucerna", "bake", scene, "-o", out, "--indirect-only", "--quiet", "--json",
                           "--unguided", "--no-decimation", *map(str, flags)],
                          capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(done.stderr)
    return *read_ply(out), sum(item["cpu_s"] for item in json.loads(done.stdout)["rounds"])


def end_after(photons):
    return ["--passes", photons // PHOTONS_PER_PASS, "--photons-per-pass", PHOTONS_PER_PASS,
            "--seed", 1]


def mse(values, truth):
    pairs = [(a, b[2]) for a, b in zip(values, truth) if a is not None]
    mean = sum(b for _, b in pairs) / len(pairs)
    return sum((a - b) ** 2 for a, b in pairs) / len(pairs) / mean**2


def measure(scene, folder):
    path = ROOT / "tests/scenes" / f"{scene}.pbrt"
    diagonal = diagonal_of(path, folder)
    out = folder / "mesh.ply"
    # One round: edges are longest of 16 spacings, and nothing is refined.
    mesh = ["--spacing", diagonal / MESH_EDGES / 16, "--tolerance", 10]
    width = diagonal / 24
    truth, _, _ = bake(path, out, [*mesh, "--photons-per-pass", 1 << 18, "--passes", 1 << 7, "--seed", 2,
                                "--radius-controller", "ppm", "--initial-radius", width / 4])
    rows = []
    for photons in PHOTONS:
        grown = photons / PHOTONS[0]
        at_vertices = {
            "kernel": ["--radius-controller", "fixed", "--initial-radius", width * grown**(-1 / 6)],
            "nearest": ["--estimator", "nearest", "--initial-radius", 2 * width],
            "appm": ["--radius-controller", "appm", "--initial-radius", width],
            "ppm": ["--radius-controller", "ppm", "--initial-radius", width],
            "frequency-mse": ["--radius-controller", "frequency-mse", "--initial-radius", width],
        }
        for name, flags in at_vertices.items():
            vertices, _, seconds = bake(path, out, [*mesh, *end_after(photons), *flags])
            rows.append([scene, name, photons, mse([v[2] for v in vertices], truth), seconds])
        vertices, faces, seconds = bake(path, out, ["--estimator", "histogram", "--spacing",
                                           2 * width * grown**-0.25, *end_after(photons)])
        buckets = Interpolation(vertices, faces, 2 * width)
        rows.append([scene, "histogram", photons, mse([buckets.at(v) for v in truth], truth), seconds])
        for row in rows[-6:]:
            print(",".join(map(str, row)), flush=True)
    return rows


def slope(points):
    x = [math.log(p) for p, _ in points]
    y = [math.log(e) for _, e in points]
    mx, my = sum(x) / len(x), sum(y) / len(y)
    return sum((a - mx) * (b - my) for a, b in zip(x, y)) / sum((a - mx) ** 2 for a in x)


def plot(path, rows):
    colors = {"histogram": "#b40", "nearest": "#05b", "kernel": "#393", "appm": "#000", "ppm": "#888",
              "frequency-mse": "#909"}
    scenes = list(dict.fromkeys(row[0] for row in rows))
    width, height, margin = 300, 250, 40
    total = 2 * height + 20
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width * len(scenes)}" height="{total}" '
           'font-family="sans-serif" font-size="11">',
           f'<rect width="{width * len(scenes)}" height="{total}" fill="white"/>']
    # A row of plots against photons, and one against seconds.
    for row_number, (what, column, text) in enumerate(
            [("photons", 2, lambda x: f"2^{int(math.log2(x))}"), ("processor time", 4, lambda x: f"{x:.2g} s")]):
        for index, scene in enumerate(scenes):
            own = [row for row in rows if row[0] == scene]
            low, high = min(r[3] for r in own) * 0.7, max(r[3] for r in own) * 1.4
            first, last = min(r[column] for r in own), max(r[column] for r in own)

            def place(at, error):
                # pylint: disable=cell-var-from-loop
                x = margin + (width - 2 * margin) * math.log(at / first) / math.log(last / first)
                y = height - margin - (height - 2 * margin) * math.log(error / low) / math.log(high / low)
                return f"{x + index * width:.1f},{y + row_number * height:.1f}"

            out.append(f'<text x="{index * width + 40}" y="{row_number * height + 20}">'
                       f'{scene}: MSE against {what}</text>')
            for error in (low * 1.4, high / 1.4):
                y = place(first, error).split(",")[1]
                out.append(f'<text x="{index * width + 2}" y="{y}">{error:.2g}</text>')
            for name, color in colors.items():
                line = " ".join(place(r[column], r[3]) for r in own if r[1] == name)
                out.append(f'<polyline points="{line}" fill="none" stroke="{color}"/>')
            for at in PHOTONS if column == 2 else (first, math.sqrt(first * last), last):
                x = place(at, low).split(",", maxsplit=1)[0]
                out.append(f'<text x="{x}" y="{(row_number + 1) * height - 22}" text-anchor="middle">'
                           f'{text(at)}</text>')
    for index, (name, color) in enumerate(colors.items()):
        out.append(f'<text x="{40 + 110 * index}" y="{total - 10}" fill="{color}">{name}</text>')
    path.write_text("\n".join(out + ["</svg>"]) + "\n", encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("scenes", nargs="*", default=SCENES)
    parser.add_argument("--docs", type=pathlib.Path, default=ROOT / "docs/measurements")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rows = [row for scene in arguments.scenes for row in measure(scene, pathlib.Path(folder))]
    with (arguments.docs / "irradiance-estimators.csv").open("w", newline="", encoding="utf-8") as file:
        file.write("# tests/bench/irradiance_estimators.py; slopes are those of the error against photons\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["scene", "estimator", "photons", "relative_mse", "cpu_s"])
        for row in rows:
            writer.writerow([*row[:3], f"{row[3]:.4g}", f"{row[4]:.3g}"])
        for scene, name in dict.fromkeys((row[0], row[1]) for row in rows):
            points = [(row[2], row[3]) for row in rows if row[:2] == [scene, name]]
            writer.writerow([scene, name, "slope", f"{slope(points):.3f}", ""])
    plot(arguments.docs / "irradiance-estimators.svg", rows)


if __name__ == "__main__":
    main()
