#!/usr/bin/env python3
"""Random scenes for judging the error estimate.

  tests/tools/make_study_scenes.py FOLDER [--half a|b]

Writes twelve scenes of each half (a: constants may be chosen on them; b: for judging only) as pbrt
files without other files. The same call writes the same bytes. Scenes differ by family (what makes
the light) and by random numbers (sizes, places, colours, kinds of light).
"""
import argparse
import math
import pathlib
import random

SEEDS = {"a": 130, "b": 2718}

HEADER = """\
# {title}
# Written by tests/tools/make_study_scenes.py, half {half}, number {number}.
Scale -1 1 1
LookAt {eye}  {look}  0 0 1
Camera "perspective" "float fov" [{fov}]
Film "rgb" "integer xresolution" [256] "integer yresolution" [256] "string filename" ["{name}.exr"]
PixelFilter "box"
Sampler "halton" "integer pixelsamples" [32]
Integrator "sppm" "integer maxdepth" [8]

WorldBegin
"""


def text(values):
    return " ".join(f"{value:.6g}" for value in values)


# As numbers, and not by name: tests/bench/references has images with these.
METALS = {"Ag": ("0.155265 0.116723 0.138381", "4.828358 3.122472 2.147055"),
          "Al": ("1.657460 0.880369 0.521229", "9.223869 6.269523 4.837001"),
          "Au": ("0.143119 0.374957 1.442479", "3.983160 2.385721 1.603215"),
          "Cu": ("0.200438 0.924033 1.102212", "3.912949 2.452848 2.142188")}


class Scene:
    def __init__(self, rng):
        self.rng = rng
        self.body = []
        self.eye, self.look, self.fov = (0, -3.6, 1.5), (0, 0, 0.8), 42

    def add(self, *lines):
        self.body.extend(lines)

    def between(self, low, high):
        return self.rng.uniform(low, high)

    def color(self, low=0.2, high=0.8):
        return [self.between(low, high) for _ in range(3)]

    def camera(self, eye, look, fov):
        self.eye = [value + self.between(-0.1, 0.1) for value in eye]
        self.look, self.fov = look, fov * self.between(0.9, 1.1)

    # Materials, as one line each.
    def diffuse(self, low=0.2, high=0.8):
        return f'Material "diffuse" "rgb reflectance" [{text(self.color(low, high))}]'

    def black(self):
        return 'Material "diffuse" "rgb reflectance" [0 0 0]'

    def glass(self, index=None, roughness=0.0):
        index = index or self.between(1.3, 1.7)
        rough = f' "float roughness" [{roughness:.4g}]' if roughness else ""
        return f'Material "dielectric" "float eta" [{index:.5g}]{rough}'

    def metal(self, roughness=0.0):
        eta, k = METALS[self.rng.choice(["Ag", "Al", "Au", "Cu"])]
        rough = f' "float roughness" [{roughness:.4g}]' if roughness else ""
        return f'Material "conductor" "rgb eta" [{eta}] "rgb k" [{k}]{rough}'

    def checkers(self, name, across):
        self.add(f'Texture "{name}" "spectrum" "checkerboard" "float uscale" {across} '
                 f'"float vscale" {across}',
                 f'  "rgb tex1" [{text(self.color(0.02, 0.2))}] '
                 f'"rgb tex2" [{text(self.color(0.5, 0.9))}]')
        return f'Material "diffuse" "texture reflectance" "{name}"'

    # Shapes.
    def mesh(self, material, points, faces, normals=None, uv=None, light=None):
        self.add("AttributeBegin", "  " + material)
        if light:
            self.add(f'  AreaLightSource "diffuse" "rgb L" [{text(light)}]')
        self.add('  Shape "trianglemesh"')
        self.add('    "point3 P" [' + "  ".join(text(p) for p in points) + "]")
        if normals:
            self.add('    "normal N" [' + "  ".join(text(n) for n in normals) + "]")
        if uv:
            self.add('    "point2 uv" [' + " ".join(text(p) for p in uv) + "]")
        self.add('    "integer indices" [' + "  ".join(text(f) for f in faces) + "]",
                 "AttributeEnd")

    def quad(self, material, corners, uv=False, light=None):
        self.mesh(material, corners, [(0, 1, 2), (0, 2, 3)], light=light,
                  uv=[(0, 0), (1, 0), (1, 1), (0, 1)] if uv else None)

    def floor(self, material, half=2.0, z=0.0, uv=False):
        self.quad(material, [(-half, -half, z), (half, -half, z), (half, half, z),
                             (-half, half, z)], uv=uv)

    def room(self, floor=None, height=2.4):
        """Floor, ceiling, back and side walls."""
        w, h = 1.7, height
        wall = self.diffuse(0.4, 0.8)
        self.quad(floor or self.diffuse(), [(-w, -w, 0), (w, -w, 0), (w, w, 0), (-w, w, 0)],
                  uv=True)
        self.quad(wall, [(-w, -w, h), (-w, w, h), (w, w, h), (w, -w, h)])
        self.quad(wall, [(-w, w, 0), (w, w, 0), (w, w, h), (-w, w, h)])
        self.quad(self.diffuse(), [(-w, -w, 0), (-w, w, 0), (-w, w, h), (-w, -w, h)])
        self.quad(self.diffuse(), [(w, -w, 0), (w, -w, h), (w, w, h), (w, w, 0)])

    def sphere(self, material, center, radius, light=None):
        self.add("AttributeBegin", "  " + material)
        if light:
            self.add(f'  AreaLightSource "diffuse" "rgb L" [{text(light)}]')
        self.add(f"  Translate {text(center)}", f'  Shape "sphere" "float radius" [{radius:.5g}]',
                 "AttributeEnd")

    def box(self, material, low, high):
        x, y, z = zip(low, high)
        points = [(x[i & 1], y[i >> 1 & 1], z[i >> 2 & 1]) for i in range(8)]
        self.mesh(material, points,
                  [(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4),
                   (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)])

    # Lights.
    def warm(self, scale):
        return [scale, scale * self.between(0.8, 1), scale * self.between(0.6, 0.95)]

    def panel(self, x, y, z, half, radiance):
        """A square light that faces down."""
        self.quad(self.black(), [(x - half, y - half, z), (x - half, y + half, z),
                                 (x + half, y + half, z), (x + half, y - half, z)],
                  light=self.warm(radiance))

    def point(self, place, intensity):
        self.add(f'LightSource "point" "rgb I" [{text(self.warm(intensity))}] '
                 f'"point3 from" [{text(place)}]')

    def sun(self, slant, radiance):
        angle = self.between(0, 2 * math.pi)
        direction = (slant * math.cos(angle), slant * math.sin(angle), 1)
        self.add(f'LightSource "distant" "rgb L" [{text(self.warm(radiance))}] '
                 f'"point3 from" [{text(direction)}] "point3 to" [0 0 0]')


def beads(scene):
    scene.room()
    for _ in range(scene.rng.randint(5, 11)):
        radius = scene.between(0.08, 0.32)
        place = (scene.between(-1.2, 1.2), scene.between(-0.9, 1.2), radius + 0.002)
        kind = scene.rng.random()
        material = (scene.glass() if kind < 0.5 else scene.metal() if kind < 0.8
                    else scene.metal(scene.between(0.05, 0.3)))
        scene.sphere(material, place, radius)
    if scene.rng.random() < 0.5:
        scene.panel(scene.between(-0.6, 0.6), scene.between(-0.6, 0.6), 2.38,
                    scene.between(0.1, 0.4), 20)
    else:
        scene.point((scene.between(-0.6, 0.6), scene.between(-0.6, 0.6), 2.2), 6)
    return "Glass and metal beads in a room."


def bars(scene):
    """A floor that sees a light through a pane only, past a row of bars."""
    scene.camera((0, -1.9, 0.9), (0, -0.1, 0), 48)
    scene.floor(scene.diffuse(0.4, 0.8))
    count = scene.rng.randint(5, 16)
    pitch = 2 / count
    height = scene.between(1.1, 1.9)
    thickness = pitch * scene.between(0.3, 0.6)
    tilt = scene.between(-0.4, 0.4)
    for i in range(count):
        x = -1 + (i + 0.5) * pitch
        scene.quad(scene.black(),
                   [(x - thickness / 2 - tilt, -2, height), (x + thickness / 2 - tilt, -2, height),
                    (x + thickness / 2 + tilt, 2, height), (x - thickness / 2 + tilt, 2, height)])
    half = scene.rng.choice([0.02, 0.1, 0.3])
    scene.panel(scene.between(-0.4, 0.4), scene.between(-0.4, 0.4), 2.6, half, 4 / half**2)
    # A pane: no shadow ray reaches the light.
    scene.quad(scene.glass(1.0001), [(-3, -3, 2.4), (3, -3, 2.4), (3, 3, 2.4), (-3, 3, 2.4)])
    return "Shadows of bars under a pane."


def holes(scene):
    """A plate with square holes below a light: spots of light on the floor."""
    scene.camera((0, -2.6, 1.3), (0, 0.1, 0.1), 46)
    scene.room(height=2.8)
    cells = scene.rng.randint(3, 7)
    share = scene.between(0.15, 0.5)
    edges = [-1.7 + 3.4 * i / cells for i in range(cells + 1)]
    z = scene.between(1.4, 1.9)
    plate = scene.diffuse(0.05, 0.4)

    def strip(x0, x1, y0, y1):
        scene.quad(plate, [(x0, y0, z), (x0, y1, z), (x1, y1, z), (x1, y0, z)])

    hole = share * 3.4 / cells
    before = -1.7
    for i in range(cells):  # strips along x without holes, and between them what is left
        middle = (edges[i] + edges[i + 1]) / 2
        y0, y1 = middle - hole / 2, middle + hole / 2
        strip(-1.7, 1.7, before, y0)
        x_before = -1.7
        for j in range(cells):
            x = (edges[j] + edges[j + 1]) / 2
            strip(x_before, x - hole / 2, y0, y1)
            x_before = x + hole / 2
        strip(x_before, 1.7, y0, y1)
        before = y1
    strip(-1.7, 1.7, before, 1.7)
    if scene.rng.random() < 0.5:
        scene.point((scene.between(-0.5, 0.5), scene.between(-0.5, 0.5), 2.6), 14)
    else:
        half = scene.between(0.05, 0.25)
        scene.panel(scene.between(-0.5, 0.5), scene.between(-0.5, 0.5), 2.7, half, 9 / half**2)
    return "Light through the holes of a plate."


def checkers(scene):
    scene.camera((0, -3.2, 1.4), (0, 0, 0.7), 44)
    scene.room(floor=scene.checkers("floor", scene.rng.randint(12, 60)))
    scene.sphere(scene.checkers("ball", scene.rng.randint(8, 30)),
                 (scene.between(-0.8, 0.8), 0.4, 0.5), 0.5)
    scene.sphere(scene.glass(), (scene.between(-0.9, 0.9), -0.5, 0.32), 0.3)
    scene.panel(scene.between(-0.7, 0.7), 0, 2.38, scene.between(0.1, 0.5), 18)
    return "Fine checkers in a room."


def glossy(scene):
    rough = scene.between(0.03, 0.4)
    floor = scene.metal(rough) if scene.rng.random() < 0.6 else scene.glass(1.5, rough)
    scene.room(floor=floor)
    for _ in range(3):
        radius = scene.between(0.2, 0.4)
        material = scene.rng.choice([scene.diffuse(), scene.glass(),
                                     scene.metal(scene.between(0.05, 0.3))])
        scene.sphere(material, (scene.between(-1.1, 1.1), scene.between(-0.5, 1), radius + 0.01),
                     radius)
    scene.panel(scene.between(-0.8, 0.8), scene.between(-0.5, 0.8), 2.38,
                scene.between(0.15, 0.5), 16)
    return "A floor of rough metal or glass."


def waves(scene):
    """A pool, its floor seen from below the surface or through it."""
    depth = scene.between(0.4, 1.0)
    below = scene.rng.random() < 0.5
    if below:
        scene.camera((0, -0.5, depth * 0.6), (0, 0.15, 0), 60)
    else:
        scene.camera((0, -1.3, depth + 1.2), (0, 0, 0), 34)
    scene.floor(scene.diffuse(0.4, 0.8), half=0.8)
    components = [(scene.between(0.006, 0.02) * length, length, scene.between(0, 2 * math.pi),
                   scene.between(0, 2 * math.pi))
                  for length in (scene.between(0.15, 0.6) for _ in range(5))]
    cells, half = 72, 1.0
    points, normals = [], []
    for j in range(cells + 1):
        for i in range(cells + 1):
            x, y = half * (2 * i / cells - 1), half * (2 * j / cells - 1)
            z, sx, sy = depth, 0.0, 0.0
            for amplitude, length, angle, phase in components:
                k = 2 * math.pi / length
                kx, ky = k * math.cos(angle), k * math.sin(angle)
                z += amplitude * math.sin(kx * x + ky * y + phase)
                sx += amplitude * kx * math.cos(kx * x + ky * y + phase)
                sy += amplitude * ky * math.cos(kx * x + ky * y + phase)
            norm = math.sqrt(1 + sx * sx + sy * sy)
            points.append((x, y, z))
            normals.append((-sx / norm, -sy / norm, 1 / norm))
    faces = []
    for j in range(cells):
        for i in range(cells):
            a = j * (cells + 1) + i
            faces += [(a, a + 1, a + cells + 2), (a, a + cells + 2, a + cells + 1)]
    scene.mesh(scene.glass(1.33), points, faces, normals=normals)
    if scene.rng.random() < 0.6:
        scene.sun(scene.between(0, 0.5), 2.5)
    else:
        half = scene.between(0.02, 0.2)
        scene.panel(scene.between(-0.3, 0.3), scene.between(-0.3, 0.3), depth + 2, half,
                    6 / half**2)
    return "Light through the waves of a pool."


def emitters(scene):
    scene.room()
    for _ in range(scene.rng.randint(2, 6)):
        radius = scene.between(0.01, 0.06)
        place = (scene.between(-1.3, 1.3), scene.between(-0.8, 1.3), scene.between(0.3, 2.1))
        scene.sphere(scene.black(), place, radius,
                     light=[value * 0.05 / radius**2 for value in scene.color(2, 10)])
    for _ in range(3):
        x, y, size = scene.between(-1.2, 0.9), scene.between(-0.6, 1), scene.between(0.2, 0.5)
        scene.box(scene.diffuse(), (x, y, 0), (x + size, y + size, size * scene.between(0.5, 2.5)))
    scene.sphere(scene.metal(), (scene.between(-1, 1), -0.5, 0.28), 0.27)
    return "Small emitters in a room."


def enclosed(scene):
    """A light inside glass: all of its light is carried by photons."""
    scene.room()
    place = (scene.between(-0.8, 0.8), scene.between(-0.4, 0.8), scene.between(1.2, 1.9))
    outer = scene.between(0.15, 0.35)
    inner = outer * scene.between(0.2, 0.6)
    scene.sphere(scene.glass(scene.rng.choice([1.0001, 1.3, 1.5])), place, outer)
    scene.sphere(scene.black(), place, inner, light=scene.warm(1.2 / inner**2))
    for _ in range(scene.rng.randint(2, 5)):
        x, y, size = scene.between(-1.2, 0.9), scene.between(-0.6, 1), scene.between(0.1, 0.6)
        scene.box(scene.diffuse(), (x, y, 0), (x + size, y + size, size * scene.between(0.5, 2.5)))
    return "A light inside glass."


FAMILIES = [beads, bars, holes, checkers, glossy, waves, emitters, enclosed]
# Both halves have all families; each has four of them twice.
TWICE = {"a": [beads, bars, checkers, waves], "b": [holes, waves, glossy, emitters]}


def write(folder, half):
    counts = {}
    for number, family in enumerate(FAMILIES + TWICE[half]):
        scene = Scene(random.Random(SEEDS[half] * 1000 + number))
        title = family(scene)
        counts[family] = counts.get(family, 0) + 1
        name = f"{half}-{family.__name__}-{counts[family]}"
        header = HEADER.format(title=title, half=half, number=number, eye=text(scene.eye),
                               look=text(scene.look), fov=f"{scene.fov:.5g}", name=name)
        (folder / f"{name}.pbrt").write_text(header + "\n".join(scene.body) + "\n",
                                             encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--half", choices=sorted(SEEDS), action="append")
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    for half in arguments.half or sorted(SEEDS):
        write(arguments.folder, half)


if __name__ == "__main__":
    main()
