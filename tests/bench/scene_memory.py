#!/usr/bin/env python3
"""How much memory does a scene take, beside what `lucerna plan` predicts?

Starts a coordinator and a worker for each scene, renders two passes of 64 x 64 pixels, and compares
the greatest resident size of both (VmHWM) with the prediction; what both have without a scene
(that of the first one) is taken off. With --make the scenes of which the project has none are
written first: many triangles, edges, instances, lights, pictures.

    tests/bench/scene_memory.py --bin build/release/bin --make DIR [SCENE...] > docs/measurements/scene-memory.csv
"""
import argparse
import array
import json
import math
import pathlib
import random
import re
import struct
import subprocess
import sys
import threading
import zlib

HEAD = """LookAt 0 -3 2  0 0 0  0 0 1
Camera "perspective" "float fov" 50
Film "rgb" "integer xresolution" 64 "integer yresolution" 64
WorldBegin
LightSource "point" "point3 from" [0 0 3] "rgb I" [10 10 10]
"""
DIFFUSE = 'Material "diffuse"\n'


def write_ply(path, positions, corners):
    """Positions: floats, three a vertex. Corners: integers, three a triangle."""
    header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(positions) // 3}\n"
              "property float x\nproperty float y\nproperty float z\n"
              f"element face {len(corners) // 3}\nproperty list uchar int vertex_indices\nend_header\n")
    face = struct.Struct("<B3i")
    rows = bytearray(face.size * (len(corners) // 3))
    for i in range(0, len(corners), 3):
        face.pack_into(rows, i // 3 * face.size, 3, *corners[i:i + 3])
    path.write_bytes(header.encode() + array.array("f", positions).tobytes() + rows)


def wavy_field(triangles):
    side = int(math.sqrt(triangles / 2))
    positions, corners = array.array("f"), array.array("i")
    wave_x = [0.02 * math.sin(40 * x / side) for x in range(side + 1)]
    for y in range(side + 1):
        wave_y = math.cos(34 * y / side)
        for x in range(side + 1):
            positions.extend((2 * x / side - 1, 2 * y / side - 1, wave_x[x] * wave_y))
    for y in range(side):
        for x in range(side):
            a = y * (side + 1) + x
            corners.extend((a, a + 1, a + side + 2, a, a + side + 2, a + side + 1))
    return positions, corners


def loose_triangles(count):
    """No two share a side, so that all sides are edges."""
    numbers = random.Random(1)
    size = 0.3 / math.sqrt(count)
    positions = array.array("f")
    for _ in range(count):
        at = [numbers.uniform(-1, 1) for _ in range(3)]
        for _ in range(3):
            positions.extend(c + numbers.gauss(0, size) for c in at)
    return positions, array.array("i", range(3 * count))


def ball(side):
    positions, corners = array.array("f", (0, 0, 1)), array.array("i")
    for i in range(1, side):
        for j in range(side):
            t, a = math.pi * i / side, 2 * math.pi * j / side
            positions.extend((math.sin(t) * math.cos(a), math.sin(t) * math.sin(a), math.cos(t)))
    positions.extend((0, 0, -1))
    last = len(positions) // 3 - 1
    for j in range(side):
        k = (j + 1) % side
        corners.extend((0, 1 + j, 1 + k, last, last - side + k, last - side + j))
        for i in range(side - 2):
            a, b = 1 + i * side, 1 + (i + 1) * side
            corners.extend((a + j, b + j, b + k, a + j, b + k, a + k))
    return positions, corners


def write_png(path, side):
    numbers = random.Random(2)
    tile = 128
    colors = [[bytes(numbers.randrange(256) for _ in range(3)) * tile for _ in range(side // tile)]
              for _ in range(side // tile)]
    rows = b"".join((b"\0" + b"".join(row)) * tile for row in colors)

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" +
                     chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(rows, 1)) + chunk(b"IEND", b""))


def make_scenes(folder):
    folder.mkdir(parents=True, exist_ok=True)
    scenes = []

    def shape(name):
        return f'Shape "plymesh" "string filename" "{name}.ply"\n'

    def add(name, body):
        (folder / f"{name}.pbrt").write_text(HEAD + body)
        scenes.append(str(folder / f"{name}.pbrt"))
    write_ply(folder / "object.ply", *wavy_field(30_000))
    for name, count in (("field-1e5", 100_000), ("field-1e6", 1_000_000), ("field-5e6", 5_000_000)):
        write_ply(folder / f"{name}.ply", *wavy_field(count))
        add(name, DIFFUSE + shape(name))
    write_ply(folder / "loose-1e6.ply", *loose_triangles(1_000_000))
    add("loose-1e6", DIFFUSE + shape("loose-1e6"))
    write_ply(folder / "ball.ply", *ball(700))
    add("glass-1e6", DIFFUSE + shape("field-1e5") + "Translate 0 0 1\nScale .4 .4 .4\n"
        'Material "dielectric"\n' + shape("ball"))

    def instances(side):
        return "".join(f"AttributeBegin\nTranslate {4 * i / side - 2:.4f} {4 * j / side - 2:.4f} 0\n"
                       f'Scale {2 / side} {2 / side} {2 / side}\nObjectInstance "o"\nAttributeEnd\n'
                       for i in range(side) for j in range(side))
    begin = DIFFUSE + 'ObjectBegin "o"\n' + shape("object") + "ObjectEnd\n"
    add("instances-25600", begin + instances(160))
    add("instances-100489", begin + instances(317))
    for k in range(4):
        write_png(folder / f"picture{k}.png", 8192)
    add("pictures-8192", "".join(
        f'Texture "t{k}" "spectrum" "imagemap" "string filename" "picture{k}.png"\n'
        f'AttributeBegin\nTranslate {2 * k - 3} 0 0\nMaterial "diffuse" "texture reflectance" "t{k}"\n'
        f'{shape("object")}AttributeEnd\n' for k in range(4)))
    add("light-1e5", DIFFUSE + shape("field-1e5") + "Translate 0 0 2\n"
        'AreaLightSource "diffuse" "rgb L" [1 1 1]\n' + shape("field-1e5"))
    numbers = random.Random(3)
    add("meshes-1e5", DIFFUSE + "".join(
        f'Shape "trianglemesh" "point3 P" [{x:.4f} {y:.4f} 0 {x + .01:.4f} {y:.4f} 0 {x:.4f} '
        f"{y + .01:.4f} 0.01]\n" for x, y in
        ((numbers.uniform(-1, 1), numbers.uniform(-1, 1)) for _ in range(100_000))))
    add("curves-1e5", DIFFUSE + "".join(
        f'Shape "curve" "float width" 0.002 "point3 P" [{x:.4f} {y:.4f} 0 {x + .01:.4f} {y:.4f} .1 '
        f"{x:.4f} {y + .01:.4f} .2 {x:.4f} {y:.4f} .3]\n" for x, y in
        ((numbers.uniform(-1, 1), numbers.uniform(-1, 1)) for _ in range(100_000))))
    return scenes


def greatest_size(process):
    status = pathlib.Path(f"/proc/{process.pid}/status").read_text()
    return int(re.search(r"VmHWM:\s+(\d+)", status)[1]) * 1024


def render(folder, scene, flags):
    """The greatest sizes of coordinator and worker [bytes]."""
    server = subprocess.Popen([f"{folder}/lucerna-server", "--listen", "127.0.0.1:0", "--threads", "2"],
                              stderr=subprocess.STDOUT, stdout=subprocess.PIPE, text=True)
    processes = [server]
    try:
        address = None
        while address is None:
            address = re.search(r"127\.0\.0\.1:[1-9]\d*", server.stdout.readline())
        threading.Thread(target=lambda: [None for _ in server.stdout], daemon=True).start()
        to = ["--server", address[0]]
        worker = subprocess.Popen([f"{folder}/lucerna-worker", "--threads", "2", *to],
                                  stderr=subprocess.DEVNULL)
        processes.append(worker)
        job = subprocess.run([f"{folder}/lucerna", "submit", scene, "--passes", "2", "--size", "64x64",
                              *flags, *to], capture_output=True, text=True, check=True).stdout.split()[0]
        subprocess.run([f"{folder}/lucerna", "watch", job, *to], capture_output=True, check=True)
        return greatest_size(server), greatest_size(worker)
    finally:
        for process in reversed(processes):
            process.terminate()
            process.wait()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--bin", default="build/release/bin")
    parser.add_argument("--make", help="folder for scenes that are made, unless it has some")
    parser.add_argument("--flags", default="", help="of the job")
    parser.add_argument("scenes", nargs="*")
    options = parser.parse_args()
    scenes = list(options.scenes)
    if options.make:
        made = pathlib.Path(options.make)
        scenes += sorted(map(str, made.glob("*-*.pbrt"))) or make_scenes(made)
    flags = options.flags.split()
    empty = pathlib.Path(options.make or "/tmp") / "empty.pbrt"
    empty.write_text(HEAD + DIFFUSE + 'Shape "sphere"\n')
    base = render(options.bin, str(empty), flags)
    print("# tests/bench/scene_memory.py " + " ".join(["--make DIR", *(f"--flags '{f}'" for f in [options.flags] if f)]))
    print("scene,part,predicted [MB],measured [MB],predicted over measured")
    for scene in scenes:
        try:
            report = json.loads(subprocess.run(
                [f"{options.bin}/lucerna", "plan", scene, "--json", "--size", "64x64", *flags],
                capture_output=True, text=True, check=True).stdout)
            sizes = render(options.bin, scene, flags)
        except subprocess.CalledProcessError as error:
            print(f"{scene}: {error.stderr}", file=sys.stderr)
            continue
        for part, size, without in zip(("coordinator", "worker"), sizes, base):
            predicted = report["scene_memory"][part + "_bytes"] / 1e6
            measured = (size - without) / 1e6
            name = pathlib.Path(scene)
            shown = name.parent.name + "/" + name.name if options.make not in (None, str(name.parent)) else name.stem
            print(f"{shown},{part},{predicted:.1f},{measured:.1f},{predicted / max(measured, 0.1):.2f}", flush=True)


if __name__ == "__main__":
    main()
