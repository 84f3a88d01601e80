#!/usr/bin/env python3
"""How many triangles does an adaptive mesh of irradiance save?

  tests/bench/irradiance_meshes.py [SCENE[:MATERIAL] ...]

For each scene (default: four of tests/scenes) `lucerna bake` measures the same surfaces by even
meshes of spacings s, 2s, 4s, 8s and 16s (--tolerance 0) and by an adaptive mesh of the finest
spacing s, all with the same photons. The vertices of the even mesh of spacing s are the truth: at
each of them the others are interpolated. Prints CSV: triangles, points that were measured, and the
root of the mean squared difference over the mean irradiance; at the end of each scene how many
times as many triangles an even mesh of the same error has (power law between two even meshes), or
has at least, where even the finest of them is worse.

Meshes are compared on planes: faces are found by two coordinates, for each surface by those that
are widest.
"""
import argparse
import json
import math
import pathlib
import struct
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = ROOT / "build/release/bin"
SCENES = ["glass-sphere", "hard-shadow", "penumbra", "cardioid"]
SPACINGS_OF_DIAGONAL = 256


def bake(scene, out, spacing, tolerance, passes):
    done = subprocess.run([BIN / "lucerna", "bake", scene, "-o", out, "--spacing", f"{spacing:g}",
                           "--tolerance", f"{tolerance:g}", "--passes", str(passes),
                           "--photons-per-pass", "262144", "--sides", "brighter", "--json", "--quiet"],
                          capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(done.stderr)
    return json.loads(done.stdout)


def read_ply(path):
    """Vertices as (position, normal, luminance) and faces."""
    data = path.read_bytes()
    header, _, body = data.partition(b"end_header\n")
    counts = [int(line.split()[2]) for line in header.decode().split("\n")
              if line.startswith("element")]
    vertices = []
    for row in struct.iter_unpack("<10f", body[:40 * counts[0]]):
        vertices.append((row[:3], row[3:6], 0.2126 * row[6] + 0.7152 * row[7] + 0.0722 * row[8]))
    faces = [row[1:] for row in struct.iter_unpack("<B3I", body[40 * counts[0]:])]
    return vertices, faces


class Interpolation:
    """A mesh on planes, by a grid of its faces."""

    def __init__(self, vertices, faces, cell):
        self.cell = cell
        self.vertices = vertices
        self.cells = {}
        for face in faces:
            key = self.plane(vertices[face[0]])
            corners = [self.flat(vertices[v][0], key) for v in face]
            low = [math.floor(min(c[i] for c in corners) / cell) for i in range(2)]
            high = [math.floor(max(c[i] for c in corners) / cell) for i in range(2)]
            for x in range(low[0], high[0] + 1):
                for y in range(low[1], high[1] + 1):
                    self.cells.setdefault((key, x, y), []).append((face, corners))

    @staticmethod
    def plane(vertex):
        """The axis of the normal, its sign, and where the plane is, coarsely."""
        axis = max(range(3), key=lambda i: abs(vertex[1][i]))
        return axis, vertex[1][axis] > 0, round(vertex[0][axis], 3)

    @staticmethod
    def flat(position, key):
        return [position[i] for i in range(3) if i != key[0]]

    def at(self, vertex):
        key = self.plane(vertex)
        x, y = self.flat(vertex[0], key)
        for face, (a, b, c) in self.cells.get((key, math.floor(x / self.cell),
                                               math.floor(y / self.cell)), []):
            area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
            if area == 0:
                continue
            u = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / area
            v = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / area
            if u >= -1e-6 and v >= -1e-6 and u + v <= 1 + 1e-6:
                values = [self.vertices[i][2] for i in face]
                return (1 - u - v) * values[0] + u * values[1] + v * values[2]
        return None


def error_of(mesh, truth, cell):
    interpolation = Interpolation(*mesh, cell)
    total, count, mean = 0.0, 0, 0.0
    for vertex in truth[0]:
        value = interpolation.at(vertex)
        if value is None:
            continue
        total += (value - vertex[2]) ** 2
        mean += vertex[2]
        count += 1
    return math.sqrt(total / count) / (mean / count)


def diagonal_of(scene, folder):
    """From the default spacing, which is a 512th of it."""
    bake(scene, folder / "any.glb", 1e9, 0.5, 1)
    data = (folder / "any.glb").read_bytes()
    size = struct.unpack("<I", data[12:16])[0]
    positions = [a for a in json.loads(data[20:20 + size])["accessors"] if "min" in a]
    low = [min(a["min"][i] for a in positions) for i in range(3)]
    high = [max(a["max"][i] for a in positions) for i in range(3)]
    return math.dist(low, high)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("scenes", nargs="*", default=SCENES)
    parser.add_argument("--passes", type=int, default=64)
    parser.add_argument("--tolerance", type=float, default=0.05)
    arguments = parser.parse_args()
    print("scene,mesh,triangles,points,error")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for scene in arguments.scenes:
            path = ROOT / "tests/scenes" / f"{scene}.pbrt"
            spacing = diagonal_of(path, folder) / SPACINGS_OF_DIAGONAL
            out = folder / "mesh.ply"
            rows = []
            truth = None
            for label, factor, tolerance in [("even", 1, 0), ("adaptive", 1, arguments.tolerance),
                                             ("even", 2, 0), ("even", 4, 0), ("even", 8, 0),
                                             ("even", 16, 0)]:
                report = bake(path, out, spacing * factor, tolerance, arguments.passes)
                mesh = read_ply(out)
                if truth is None:
                    truth = mesh
                    continue
                points = sum(item["points"] for item in report["rounds"])
                rows.append((label, len(mesh[1]), points, error_of(mesh, truth, 8 * spacing)))
                print(f"{scene},{label} {factor}s,{rows[-1][1]},{points},{rows[-1][3]:.4f}", flush=True)
            _, triangles, _, error = rows[0]
            evens = sorted((row[3], row[1]) for row in rows[1:])
            ratio = f"more than {evens[0][1] / triangles:.1f}"
            for (low, many), (high, few) in zip(evens, evens[1:]):
                if low <= error <= high:
                    slope = math.log(many / few) / math.log(high / low)
                    ratio = f"{many * (error / low) ** -slope / triangles:.1f}"
            print(f"{scene},even over adaptive at equal error,{ratio},,", flush=True)


if __name__ == "__main__":
    main()
