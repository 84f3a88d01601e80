#!/usr/bin/env python3
"""Writes tests/scenes/forest.pbrt, hair.pbrt and locks.pbrt, the same bytes every time.

forest: 400 instances of three trees of some 25,000 triangles each under a low sun; written out they
would be ten million triangles. hair: a ball with curves of all types on a table, lit by a lamp.
locks: four locks of the material hair before a wall, lit from the side and from behind.

    python3 tests/tools/make_shape_scenes.py
    python3 tests/tools/make_shape_scenes.py --large large.pbrt   # 25,250 instances, to measure memory
"""
import math
import pathlib
import random
import sys

SCENES = pathlib.Path(__file__).resolve().parent.parent / "scenes"

OCTAHEDRON = "0 2 4 2 1 4 1 3 4 3 0 4 2 0 5 1 2 5 3 1 5 0 3 5"


def numbers(values):
    return " ".join(f"{value:.4g}" for value in values)


def crown(rng, height, size):
    """A subdivided octahedron whose corners are moved a little."""
    points = []
    for x, y, z in [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1.4), (0, 0, -0.8)]:
        stretch = size * rng.uniform(0.8, 1.3)
        points += [x * stretch, y * stretch, height + z * stretch]
    return (f'  Shape "loopsubdiv" "integer levels" 5 "point3 P" [{numbers(points)}]\n'
            f'    "integer indices" [{OCTAHEDRON}]\n')


def forest():
    rng = random.Random(17)
    text = """# Made by tests/tools/make_shape_scenes.py: a forest of instances under a low sun.
LookAt 0 -30 9  0 0 2  0 0 1
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 320 "integer yresolution" 180 "string filename" "forest.exr"
Integrator "sppm" "integer maxdepth" 8
WorldBegin
LightSource "infinite" "rgb L" [0.25 0.35 0.5]
LightSource "distant" "point3 from" [-1 -0.6 0.8] "point3 to" [0 0 0] "rgb L" [2.4 2 1.5]
MakeNamedMaterial "soil" "string type" "diffuse" "rgb reflectance" [0.25 0.2 0.12]
MakeNamedMaterial "bark" "string type" "diffuse" "rgb reflectance" [0.2 0.13 0.08]
NamedMaterial "soil"
Shape "bilinearmesh" "point3 P" [-60 -40 0  60 -40 0  -60 80 0  60 80 3]
"""
    greens = [(0.1, 0.3, 0.06), (0.18, 0.34, 0.08), (0.3, 0.26, 0.06)]
    for number, green in enumerate(greens):
        text += f'ObjectBegin "tree{number}"\n  NamedMaterial "bark"\n'
        text += '  Shape "cylinder" "float radius" 0.16 "float zmin" 0 "float zmax" 1.6\n'
        text += f'  Material "diffuse" "rgb reflectance" [{numbers(green)}]\n'
        for layer in range(3):
            text += crown(rng, 1.5 + 0.8 * layer, 1 - 0.25 * layer)
        text += "ObjectEnd\n"
    for row in range(20):
        for column in range(20):
            x = 2.4 * (column - 9.5) + rng.uniform(-0.8, 0.8)
            y = 2.4 * row - 14 + rng.uniform(-0.8, 0.8)
            size = rng.uniform(0.7, 1.3)
            text += (f"AttributeBegin Translate {x:.3f} {y:.3f} 0 Rotate {rng.uniform(0, 360):.1f} "
                     f"0 0 1 Scale {size:.3f} {size:.3f} {size * rng.uniform(0.9, 1.3):.3f} "
                     f'ObjectInstance "tree{rng.randrange(3)}" AttributeEnd\n')
    return text


def hair():
    rng = random.Random(5)
    text = """# Made by tests/tools/make_shape_scenes.py: a ball with hair, and ribbons, under a lamp.
LookAt 0 -5 2.2  0 0 0.7  0 0 1
Camera "perspective" "float fov" 36
Film "rgb" "integer xresolution" 240 "integer yresolution" 180 "string filename" "hair.exr"
Integrator "sppm" "integer maxdepth" 12
WorldBegin
LightSource "infinite" "rgb L" [0.15 0.17 0.2]
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [14 12 9]
  Translate -1.5 -1.5 3.5
  Rotate 180 1 0 0
  Shape "disk" "float radius" 0.6
AttributeEnd
Material "diffuse" "rgb reflectance" [0.5 0.5 0.5]
Shape "bilinearmesh" "point3 P" [-4 -4 0  4 -4 0  -4 4 0  4 4 0]
Material "diffuse" "rgb reflectance" [0.4 0.2 0.1]
AttributeBegin Translate 0 0 0.75 Shape "sphere" "float radius" 0.5 AttributeEnd
Material "conductor" "float roughness" 0.1 "rgb reflectance" [0.75 0.5 0.25]
"""
    for i in range(220):
        z = rng.uniform(-0.3, 1)
        phi = rng.uniform(0, 2 * math.pi)
        out = [math.sqrt(1 - z * z) * math.cos(phi), math.sqrt(1 - z * z) * math.sin(phi), z]
        droop = rng.uniform(0.2, 0.45)
        points = []
        for step in range(4):
            along = 0.5 + 0.17 * step
            sway = 0.05 * step
            points += [out[0] * along + rng.uniform(-sway, sway),
                       out[1] * along + rng.uniform(-sway, sway),
                       0.75 + out[2] * along - droop * (step / 3) ** 2]
        kind = "cylinder" if i % 2 == 0 else "flat"
        text += (f'Shape "curve" "string type" "{kind}" "point3 P" [{numbers(points)}] '
                 f'"float width0" 0.016 "float width1" 0.003\n')
    text += 'Material "diffuse" "rgb reflectance" [0.15 0.4 0.1]\n'
    for i in range(40):
        x = rng.uniform(-2, 2)
        y = rng.uniform(0.8, 2)
        points = []
        for step in range(4):
            points += [x + 0.1 * step * rng.uniform(-1, 1), y - 0.08 * step * step / 2, 0.3 * step]
        text += (f'Shape "curve" "string type" "ribbon" "point3 P" [{numbers(points)}] '
                 f'"normal N" [{numbers([rng.uniform(-0.5, 0.5), -1, 0])} 0 -1 0.4] '
                 f'"float width0" 0.08 "float width1" 0.01\n')
    return text


def locks():
    rng = random.Random(11)
    text = """# Made by tests/tools/make_shape_scenes.py: locks of hair, by melanin, reflectance and absorption.
LookAt 0 -5.2 1.3  0 0 1.05  0 0 1
Camera "perspective" "float fov" 34
Film "rgb" "integer xresolution" 240 "integer yresolution" 180 "string filename" "locks.exr"
Integrator "sppm" "integer maxdepth" 24
WorldBegin
LightSource "infinite" "rgb L" [0.12 0.13 0.15]
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [16 15 13]
  Translate -2.4 -1.8 3
  Rotate 140 -0.6 0.8 0
  Shape "disk" "float radius" 0.5
AttributeEnd
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [20 18 15]
  Translate 1.2 1.1 3.2
  Rotate 155 1 0 0
  Shape "disk" "float radius" 0.3
AttributeEnd
Material "diffuse" "rgb reflectance" [0.6 0.6 0.6]
Shape "bilinearmesh" "point3 P" [-4 -4 0  4 -4 0  -4 1.6 0  4 1.6 0]
Shape "bilinearmesh" "point3 P" [-4 1.6 0  4 1.6 0  -4 1.6 4  4 1.6 4]
"""
    kinds = ['"float eumelanin" 0.3 "float pheomelanin" 0.2',
             '"float pheomelanin" 1.2 "float beta_m" 0.2',
             '"rgb reflectance" [0.25 0.3 0.75] "float beta_n" 0.5',
             '"rgb sigma_a" [0.6 0.9 1.6] "float alpha" 3 "float beta_m" 0.4']
    for number, kind in enumerate(kinds):
        text += f'Material "hair" {kind}\n'
        middle = 1.04 * (number - 1.5)
        for _ in range(80):
            radius = 0.24 * math.sqrt(rng.uniform(0, 1))
            phi = rng.uniform(0, 2 * math.pi)
            curl = rng.uniform(0.04, 0.09)
            start = rng.uniform(-0.5, 0.5)
            end = rng.uniform(0.15, 0.35)
            points = []
            for step in range(7):
                share = step / 6
                turn = start + 1.5 * step
                points += [middle + radius * (0.5 + share) * math.cos(phi)
                           + curl * share * math.cos(turn),
                           radius * (0.5 + share) * math.sin(phi) + curl * share * math.sin(turn),
                           2.1 - (2.1 - end) * share]
            text += (f'Shape "curve" "string type" "cylinder" "string basis" "bspline" '
                     f'"point3 P" [{numbers(points)}] "float width0" 0.014 "float width1" 0.006\n')
    return text


def large():
    rng = random.Random(1)
    text = f"""LookAt 0 -60 30  0 0 0  0 0 1
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 160 "integer yresolution" 90
WorldBegin
LightSource "distant" "point3 from" [-1 -0.6 0.8] "point3 to" [0 0 0] "rgb L" [2 2 2]
LightSource "infinite" "rgb L" [0.2 0.3 0.4]
Shape "bilinearmesh" "point3 P" [-100 -100 0  100 -100 0  -100 100 0  100 100 0]
ObjectBegin "ball"
Shape "loopsubdiv" "integer levels" 6 "point3 P" [1 0 0 -1 0 0 0 1 0 0 -1 0 0 0 1 0 0 -1]
  "integer indices" [{OCTAHEDRON}]
ObjectEnd
"""
    for _ in range(25250):
        place = numbers([rng.uniform(-95, 95), rng.uniform(-95, 95), 0.3])
        size = numbers([rng.uniform(0.2, 0.5) for _ in range(3)])
        text += f'AttributeBegin Translate {place} Scale {size} ObjectInstance "ball" AttributeEnd\n'
    return text


if len(sys.argv) == 3 and sys.argv[1] == "--large":
    pathlib.Path(sys.argv[2]).write_text(large())
    sys.exit()
for name, scene in [("forest", forest()), ("hair", hair()), ("locks", locks())]:
    (SCENES / f"{name}.pbrt").write_text(scene)
