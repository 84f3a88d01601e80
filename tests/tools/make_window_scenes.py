#!/usr/bin/env python3
"""Random rooms lit by sun and sky through windows, for judging photon guides.

  tests/tools/make_window_scenes.py FOLDER [--count N]

Writes N scenes (default: 16) as pbrt files without other files. The same call writes the same
bytes. Rooms stand on a ground of 15 to 80 m to each side, have one to three windows and five boxes,
and differ in sizes, colours, sky and height of the sun: of ten thousand photons that enter the scene
a few come into view.
"""
import argparse
import math
import pathlib
import random

HEADER = """\
# Written by tests/tools/make_window_scenes.py, number {number}.
Scale -1 1 1
LookAt {x:.2f} {y:.2f} 1.5  {to:.2f} 0.3 1.2  0 0 1
Camera "perspective" "float fov" [75]
Film "rgb" "integer xresolution" [128] "integer yresolution" [96] "string filename" ["windows-{number}.exr"]
Integrator "sppm" "integer maxdepth" [10]

WorldBegin
LightSource "infinite" "rgb L" [{sky}]
LightSource "distant" "rgb L" [20 19 17] "point3 from" [{sun}] "point3 to" [0 0 0]
"""


def text(numbers):
    return " ".join(f"{number:.4f}" for number in numbers)


def quad(corners, color):
    return (f'Material "diffuse" "rgb reflectance" [{text(color)}]\n'
            f'Shape "trianglemesh" "point3 P" [{"  ".join(map(text, corners))}] '
            '"integer indices" [0 1 2 0 2 3]\n')


def box_between(low, high, color):
    """The top of a box and two of its sides."""
    (x0, y0), (x1, y1, z1) = low, high
    return (quad([(x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)], color)
            + quad([(x0, y0, 0), (x1, y0, 0), (x1, y0, z1), (x0, y0, z1)], color)
            + quad([(x0, y0, 0), (x0, y1, 0), (x0, y1, z1), (x0, y0, z1)], color))


def scene(number):
    rng = random.Random(number)

    def color():
        return [rng.uniform(0.3, 0.8) for _ in range(3)]

    width, depth, height = rng.uniform(4, 9), rng.uniform(4, 8), rng.uniform(2.5, 4)
    ground = rng.uniform(15, 80)
    parts = [
        quad([(-ground, -ground, -0.05), (ground, -ground, -0.05), (ground, ground, -0.05),
              (-ground, ground, -0.05)], color()),
        quad([(0, 0, 0), (width, 0, 0), (width, depth, 0), (0, depth, 0)], color()),
        quad([(0, 0, height), (width, 0, height), (width, depth, height), (0, depth, height)], color()),
        quad([(0, 0, 0), (0, depth, 0), (0, depth, height), (0, 0, height)], color()),
        quad([(width, 0, 0), (width, depth, 0), (width, depth, height), (width, 0, height)], color()),
        quad([(0, depth, 0), (width, depth, 0), (width, depth, height), (0, depth, height)], color()),
    ]

    # The wall with the windows, at y = 0.
    def wall(x0, x1, z0, z1):
        return quad([(x0, 0, z0), (x1, 0, z0), (x1, 0, z1), (x0, 0, z1)], of_wall)

    windows = rng.choice((1, 2, 3))
    of_wall = color()
    sill, lintel = 0.9, min(height - 0.3, 0.9 + rng.uniform(0.8, 1.5))
    piece = width / windows
    before = 0
    for i in range(windows):
        left = piece * i + piece * rng.uniform(0.1, 0.3)
        right = left + piece * rng.uniform(0.2, 0.6)
        parts += [wall(before, left, 0, height), wall(left, right, 0, sill),
                  wall(left, right, lintel, height)]
        before = right
    parts.append(wall(before, width, 0, height))
    for _ in range(5):
        x, y = rng.uniform(0.5, width - 1), rng.uniform(1, depth - 1)
        side, top = rng.uniform(0.2, 0.8), rng.uniform(0.3, 1.2)
        parts.append(box_between((x, y), (x + side, y + side, top), color()))
    sky = [rng.uniform(0.5, 1.5) for _ in range(3)]
    elevation = rng.uniform(0.3, 1.2)
    sun = (rng.uniform(-0.5, 0.5), -math.cos(elevation), math.sin(elevation))
    header = HEADER.format(number=number, x=width * 0.2, y=depth - 0.3, to=width * 0.7,
                           sky=text(sky), sun=text(sun))
    return header + "".join(parts)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--count", type=int, default=16)
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    for number in range(1, arguments.count + 1):
        (arguments.folder / f"windows-{number}.pbrt").write_text(scene(number), encoding="utf-8")


if __name__ == "__main__":
    main()
