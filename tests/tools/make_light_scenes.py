#!/usr/bin/env python3
"""Scenes with many lights, for judging how direct light chooses among them.

  tests/tools/make_light_scenes.py FOLDER

Writes four scenes as pbrt files without other files; the same call writes the same bytes.

  many     300 small balls in a room, of radiances that differ by a hundred
  strips   twelve tubes, six spots, sun and sky
  rooms    25 rooms with a ball each and gaps between them, seen from the middle one
  hidden   a light in the room and two just behind its wall, one of them twice as strong: what a
           choice that knows of no walls does worst
"""
import argparse
import pathlib
import random

HEADER = """\
# Written by tests/tools/make_light_scenes.py.
LookAt {look}  0 0 1
Camera "perspective" "float fov" [{fov}]
Film "rgb" "integer xresolution" [128] "integer yresolution" [128]
PixelFilter "box"
Integrator "sppm" "integer maxdepth" [8]
WorldBegin
"""


def text(numbers):
    return " ".join(f"{number:.4f}" for number in numbers)


def quad(corners, color):
    return (f'AttributeBegin\nMaterial "diffuse" "rgb reflectance" [{text(color)}]\n'
            f'Shape "trianglemesh" "point3 P" [{"  ".join(map(text, corners))}] '
            '"integer indices" [0 1 2 0 2 3]\nAttributeEnd\n')


def ball(center, radius, radiance):
    return ('AttributeBegin\nMaterial "diffuse" "rgb reflectance" [0 0 0]\n'
            f'AreaLightSource "diffuse" "rgb L" [{text(radiance)}]\n'
            f'Translate {text(center)}\nShape "sphere" "float radius" [{radius}]\nAttributeEnd\n')


ROOM = (quad([(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)], (.7, .7, .7)) +
        quad([(-2, 2, 0), (2, 2, 0), (2, 2, 2.4), (-2, 2, 2.4)], (.6, .6, .7)) +
        quad([(-2, -2, 0), (-2, 2, 0), (-2, 2, 2.4), (-2, -2, 2.4)], (.7, .5, .5)))
IN_ROOM = HEADER.format(look="0 -3.6 1.5  0 0 0.8", fov=50)


def many(rng):
    scene = IN_ROOM + ROOM
    for _ in range(300):
        power = 10 ** rng.uniform(0, 2)
        radiance = (power, power * rng.uniform(.5, 1), power * rng.uniform(.3, 1))
        center = (rng.uniform(-1.9, 1.9), rng.uniform(-1.9, 1.9), rng.uniform(.05, 2.3))
        scene += ball(center, .01, radiance)
    return scene


def strips(_):
    scene = IN_ROOM + ROOM
    scene += ('LightSource "distant" "rgb L" [1 .9 .8] "point3 from" [3 -4 6] "point3 to" [0 0 0]\n'
              'LightSource "infinite" "rgb L" [.1 .15 .3]\n')
    for i in range(12):
        y = -1.9 + .33 * i
        corners = [(-1.5, y, 2.3), (-1.5, y + .05, 2.3), (1.5, y + .05, 2.3), (1.5, y, 2.3)]
        scene += quad(corners, (.5, .5, .5)).replace(
            "Shape", 'AreaLightSource "diffuse" "rgb L" [3 3 2]\nShape', 1)
    for i in range(6):
        x = -1.5 + .6 * i
        scene += (f'LightSource "spot" "rgb I" [2 2 2] "point3 from" [{text((x, 1.8, 2.2))}] '
                  f'"point3 to" [{text((x, 1.9, 0))}] "float coneangle" [25]\n')
    return scene


def rooms(rng):
    scene = HEADER.format(look="0 -1.8 1.5  0 0.5 0.9", fov=80)
    scene += quad([(-10, -10, 0), (10, -10, 0), (10, 10, 0), (-10, 10, 0)], (.6, .6, .6))
    scene += quad([(-10, -10, 2.5), (-10, 10, 2.5), (10, 10, 2.5), (10, -10, 2.5)], (.7, .7, .7))
    for i in range(6):
        wall = -10 + 4 * i
        for j in range(5):
            low = -10 + 4 * j
            scene += quad([(wall, low, 0), (wall, low + 3, 0), (wall, low + 3, 2.5),
                           (wall, low, 2.5)], (.7, .6, .5))
            scene += quad([(low, wall, 0), (low + 3, wall, 0), (low + 3, wall, 2.5),
                           (low, wall, 2.5)], (.5, .6, .7))
    for i in range(5):
        for j in range(5):
            center = (-8 + 4 * i + rng.uniform(-1.5, 1.5), -8 + 4 * j + rng.uniform(-1.5, 1.5),
                      rng.uniform(.3, 2.3))
            scene += ball(center, .06, (30, 28, 24))
    return scene


def hidden(_):
    return (IN_ROOM + ROOM +
            quad([(.6, -2, 0), (.6, 2, 0), (.6, 2, 2.3), (.6, -2, 2.3)], (.7, .7, .7)) +
            ball((-1.5, -1.2, 2.2), .05, (40, 40, 40)) + ball((.75, .5, .5), .05, (40, 40, 40)) +
            ball((.75, -.5, 1.2), .05, (80, 80, 80)))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    for make in (many, strips, rooms, hidden):
        (folder / f"{make.__name__}.pbrt").write_text(make(random.Random(make.__name__)))


if __name__ == "__main__":
    main()
