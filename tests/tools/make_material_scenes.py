#!/usr/bin/env python3
"""Random rooms of all kinds of surfaces, for comparing the estimator with a path tracer.

  tests/tools/make_material_scenes.py FOLDER FIRST LAST [--more [--uneven] [--masked]]

Writes room-N.pbrt for the numbers FIRST to LAST. The same call writes the same bytes. Walls and
objects have random materials with random parameters, textures, mixes and bumps; light comes from
one area light or from all around, so that a path tracer finds it. `lucerna-path-check` compares
them. No light below surfaces: the path tracer knows it on planes alone.

With --more the rooms have media (fog in the room, in a part of it, inside glass), one to three
lights of all kinds, curves, hair, instances, subdivision surfaces, parts of spheres and meshes with
normals; picture.pfm is written beside them, for lights with pictures. With --uneven their media
have random densities on grids, with --masked all lights that have a shape, and half of the spheres
and boxes, have a random alpha, a number or a texture, and everything else is the same.
"""
import argparse
import math
import pathlib
import random
import struct

METALS = ["Cu", "Al", "Au"]
OBJECTS = ["diffuse", "conductor", "dielectric", "thindielectric", "coateddiffuse",
           "coatedconductor", "diffusetransmission", "mix"]
WALLS = ["diffuse", "diffuse", "coateddiffuse", "conductor", "coatedconductor",
         "diffusetransmission"]


class Room:
    """The text of one scene."""
    widest_coat = 0.6  # greatest roughness of coats over metals
    hazy_coats = 0.3   # share of those that have haze

    def __init__(self, number):
        self.random = random.Random(number)
        self.masks = None  # for alphas alone, so that everything else is the same with and without
        self.lines = []
        self.names = 0

    def write(self, line):
        self.lines.append(line)

    def name(self, prefix):
        self.names += 1
        return f"{prefix}{self.names}"

    def colour(self, low=0.1, high=0.9):
        return "[" + " ".join(f"{self.random.uniform(low, high):.3f}" for _ in range(3)) + "]"

    def number_texture(self, low, high):
        name = self.name("number")
        a, b = (f"[{self.random.uniform(low, high):.3f}]" for _ in range(2))
        kind = self.random.choice(["checkerboard", "dots", "bilerp", "fbm", "wrinkled", "windy",
                                   "mix"])
        if kind == "checkerboard":
            scales = [self.random.randint(1, 6) for _ in range(2)]
            parameters = (f'"float uscale" [{scales[0]}] "float vscale" [{scales[1]}] '
                          f'"float tex1" {a} "float tex2" {b}')
        elif kind == "dots":
            parameters = f'"float uscale" [4] "float vscale" [4] "float inside" {a} "float outside" {b}'
        elif kind == "bilerp":
            parameters = f'"float v00" {a} "float v01" {b} "float v10" {b} "float v11" {a}'
        else:
            amount = f'"float amount" [{self.random.random():.2f}]'
            if kind != "mix":
                noise = self.name("number")
                octaves = "" if kind == "windy" else ' "integer octaves" [3]'
                self.write(f'Texture "{noise}" "float" "{kind}"{octaves}')
                amount = f'"texture amount" ["{noise}"]'
                kind = "mix"
            parameters = f'{amount} "float tex1" {a} "float tex2" {b}'
        self.write(f'Texture "{name}" "float" "{kind}" {parameters}')
        return name

    def colour_texture(self):
        name = self.name("colour")
        a, b = self.colour(), self.colour()
        kind = self.random.choice(["checkerboard", "dots", "bilerp", "marble", "directionmix",
                                   "mix", "scale"])
        if kind == "checkerboard":
            parameters = f'"float uscale" [3] "float vscale" [5] "rgb tex1" {a} "rgb tex2" {b}'
        elif kind == "dots":
            parameters = f'"float uscale" [5] "float vscale" [5] "rgb inside" {a} "rgb outside" {b}'
        elif kind == "bilerp":
            parameters = f'"rgb v00" {a} "rgb v01" {b} "rgb v10" {b} "rgb v11" {a}'
        elif kind == "marble":
            parameters = '"float scale" [3]'
        elif kind == "directionmix":
            parameters = f'"rgb tex1" {a} "rgb tex2" {b} "vector3 dir" [0 1 0.3]'
        elif kind == "mix":
            parameters = f'"texture amount" ["{self.number_texture(0, 1)}"] "rgb tex1" {a} "rgb tex2" {b}'
        else:
            parameters = f'"rgb tex" {a} "texture scale" ["{self.number_texture(0.2, 1)}"]'
        self.write(f'Texture "{name}" "spectrum" "{kind}" {parameters}')
        return name

    def colour_parameter(self, name):
        if self.random.random() < 0.4:
            return f'"texture {name}" ["{self.colour_texture()}"]'
        return f'"rgb {name}" {self.colour()}'

    def roughness(self, prefix="", smooth=0.25, widest=0.6):
        """Smooth, one number, one for each direction, or a texture."""
        kind = self.random.random()
        if kind < smooth:
            return ""
        remap = ' "bool remaproughness" [false]' if self.random.random() < 0.3 else ""
        number = f"[{self.random.uniform(0.02, widest):.3f}]"
        if kind < 0.6:
            return f'"float {prefix}roughness" {number}{remap}'
        if kind < 0.8:
            other = f"[{self.random.uniform(0.02, widest):.3f}]"
            return f'"float {prefix}uroughness" {number} "float {prefix}vroughness" {other}{remap}'
        return f'"texture {prefix}roughness" ["{self.number_texture(0.02, widest)}"]{remap}'

    def haze(self, chance):
        if self.random.random() >= chance:
            return ""
        return f'"rgb albedo" {self.colour()} "float g" [{self.random.uniform(-0.6, 0.8):.2f}]'

    def metal(self, prefix=""):
        name = self.random.choice(METALS)
        return f'"spectrum {prefix}eta" ["metal-{name}-eta"] "spectrum {prefix}k" ["metal-{name}-k"]'

    def index(self, name="eta"):
        return f'"float {name}" [{self.random.uniform(1.1, 1.9):.2f}]'

    def material(self, kinds, depth=0):
        kind = self.random.choice(kinds)
        if kind == "diffuse":
            parameters = [self.colour_parameter("reflectance")]
        elif kind == "conductor":
            parameters = [self.random.choice([self.metal(), self.colour_parameter("reflectance")]),
                          self.roughness()]
        elif kind == "dielectric":
            parameters = [self.index(), self.roughness(smooth=0.5)]
        elif kind == "thindielectric":
            parameters = [self.index()]
        elif kind == "coateddiffuse":
            rough = self.roughness()
            thickness = f'"float thickness" [{self.random.choice([0.01, 0.1, 0.5, 1.5])}]'
            # One of the two may be a texture.
            if "texture" not in rough and self.random.random() < 0.3:
                thickness = f'"texture thickness" ["{self.number_texture(0.01, 2)}"]'
            parameters = [self.colour_parameter("reflectance"), self.index(), rough, thickness,
                          self.haze(0.4)]
        elif kind == "coatedconductor":
            interface = self.roughness("interface.", widest=self.widest_coat)
            conductor = "" if "texture" in interface else self.roughness("conductor.")
            colour = f'"rgb reflectance" {self.colour(0.2, 0.95)}'
            parameters = [self.random.choice([self.metal("conductor."), colour]), interface,
                          conductor, self.index("interface.eta"),
                          f'"float thickness" [{self.random.choice([0.01, 0.1, 0.5])}]',
                          self.haze(self.hazy_coats)]
        elif kind == "diffusetransmission":
            parameters = [self.colour_parameter("reflectance"),
                          self.colour_parameter("transmittance"), '"float scale" [.5]']
        else:
            simple = ["diffuse", "conductor", "dielectric", "coateddiffuse"]
            parts = [self.material(simple + (["mix"] if depth == 0 else []), depth + 1),
                     self.material(simple + ["thindielectric"], depth + 1)]
            amount = f'"float amount" [{self.random.random():.2f}]'
            if self.random.random() < 0.5:
                amount = f'"texture amount" ["{self.number_texture(0, 1)}"]'
            parameters = [f'"string materials" ["{parts[0]}" "{parts[1]}"]', amount]
        if kind not in ("mix", "thindielectric") and depth == 0 and self.random.random() < 0.2:
            parameters.append(f'"texture displacement" ["{self.number_texture(0, 0.02)}"]')
        name = self.name("material")
        self.write(f'MakeNamedMaterial "{name}" "string type" ["{kind}"] '
                   + " ".join(filter(None, parameters)))
        return name

    def wall(self, material, points):
        self.write(f'NamedMaterial "{material}"\nShape "bilinearmesh" "point3 P" [{points}]')

    def light(self, shape):
        black = self.name("material")
        self.write(f'MakeNamedMaterial "{black}" "string type" ["diffuse"] '
                   '"rgb reflectance" [0 0 0]')
        self.write(f'AttributeBegin\nNamedMaterial "{black}"\n'
                   f'AreaLightSource "diffuse" "rgb L" {self.colour(3, 9)}\n{shape}\nAttributeEnd')

    def mask(self, chance):
        """An alpha for the next shape, whose texture is written already."""
        if self.masks is None or self.masks.random() >= chance:
            return ""
        if self.masks.random() < 0.4:
            return f' "float alpha" [{self.masks.uniform(0.2, 0.9):.2f}]'
        self.random, self.masks = self.masks, self.random
        texture = self.number_texture(-0.2, 1.2)
        self.random, self.masks = self.masks, self.random
        return f' "texture alpha" ["{texture}"]'

    def object(self):
        material = self.material(OBJECTS)
        radius = self.random.uniform(0.15, 0.35)
        x, z = self.random.uniform(-0.6, 0.6), self.random.uniform(-0.6, 0.5)
        axis = f"{self.random.random():.2f} 1 {self.random.random():.2f}"
        self.write(f'AttributeBegin\nTranslate {x:.3f} {radius + 0.02:.3f} {z:.3f}\n'
                   f'Rotate {self.random.uniform(0, 360):.1f} {axis}\nNamedMaterial "{material}"')
        if self.random.random() < 0.3:
            self.write(f"Scale 1 {self.random.uniform(0.5, 1):.2f} 1")
        if self.random.random() < 0.2:
            self.write("ReverseOrientation")
        kind = self.random.choice(["sphere", "sphere", "box", "cylinder", "disk"])
        if kind == "sphere":
            alpha = ""
            if self.random.random() < 0.15:
                alpha = f' "float alpha" [{self.random.uniform(0.3, 0.9):.2f}]'
            alpha = self.mask(0.5) or alpha
            self.write(f'Shape "sphere" "float radius" [{radius:.3f}]{alpha}')
        elif kind == "cylinder":
            half = f"{radius * 0.7:.3f}"
            self.write(f'Shape "cylinder" "float radius" [{radius * 0.6:.3f}] '
                       f'"float zmin" [-{half}] "float zmax" [{half}]')
        elif kind == "disk":
            self.write(f'Shape "disk" "float radius" [{radius:.3f}] '
                       f'"float innerradius" [{radius * 0.3:.3f}]')
        else:
            self.box("trianglemesh", radius * 0.55, self.mask(0.5))
        self.write("AttributeEnd")

    def box(self, shape, half, alpha=""):
        corners = [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
        points = " ".join(f"{c * half:.3f}" for corner in corners for c in corner)
        self.write(f'Shape "{shape}" "point3 P" [{points}] "integer indices" '
                   "[0 2 1 1 2 3 4 5 6 5 7 6 0 1 4 1 5 4 2 6 3 3 6 7 0 4 2 2 4 6 1 3 5 3 7 5]"
                   + alpha)

    def text(self):
        depth = self.random.choice([5, 8, 20])
        eye = (f"{self.random.uniform(-0.3, 0.3):.2f} {self.random.uniform(0.8, 1.3):.2f} "
               f"{self.random.uniform(2.4, 2.8):.2f}")
        self.write(f'LookAt {eye}  0 .8 0  0 1 0\nCamera "perspective" "float fov" [50]\n'
                   'Film "rgb" "integer xresolution" [32] "integer yresolution" [32]\n'
                   f'PixelFilter "box"\nIntegrator "sppm" "integer maxdepth" [{depth}]\nWorldBegin')
        walls = [self.material(WALLS) for _ in range(3)]
        self.wall(walls[0], "-1 0 1  1 0 1  -1 0 -1  1 0 -1")
        self.wall(walls[1], "-1 0 -1  1 0 -1  -1 2 -1  1 2 -1")
        self.wall(walls[2], "-1 0 1  -1 0 -1  -1 2 1  -1 2 -1")
        light = self.random.choice(["rectangle", "rectangle", "sphere", "sky", "sky"])
        if light == "sky":
            self.write(f'LightSource "infinite" "rgb L" {self.colour(0.3, 1.5)}')
        else:
            self.wall(self.random.choice(walls), "1 0 -1  1 0 1  1 2 -1  1 2 1")
            self.wall(walls[0], "-1 2 -1  1 2 -1  -1 2 1  1 2 1")
            if light == "sphere":
                self.light('Translate 0 1.7 0\nShape "sphere" "float radius" [.25]')
            else:
                self.light('Shape "bilinearmesh" "point3 P" '
                           "[-.4 1.95 .4  -.4 1.95 -.4  .4 1.95 .4  .4 1.95 -.4]")
        for _ in range(self.random.randint(2, 4)):
            self.object()
        return "\n".join(self.lines) + "\n"


class RoomWithMore(Room):
    """Also media, all lights and more shapes."""
    # Wider ones and haze are known to be some % off: they would hide other faults.
    widest_coat = 0.04
    hazy_coats = 0

    def __init__(self, number, is_uneven=False, is_masked=False):
        super().__init__(number)
        if is_masked:
            self.masks = random.Random(number + 0.5)
        # For densities alone, so that everything else is the same with and without.
        self.uneven = random.Random(number) if is_uneven else None
        # A medium fills the room; the other one is in parts of it.
        self.room_medium = ""
        # Where shapes that separate media overlapped, media would depend on the way through them.
        self.quarters = [(x, z) for x in (-0.5, 0.5) for z in (-0.5, 0.45)]
        self.random.shuffle(self.quarters)

    def medium(self, absorbs_alone=False):
        name = self.name("medium")
        density = self.random.choice([0.05, 0.3, 1, 4])
        scattering = "[0 0 0]" if absorbs_alone else self.colour(0.05, 1)
        if not absorbs_alone and self.random.random() < 0.3:
            scattering = "[.5 .5 .5]"
        absorption = self.random.choice(["[0 0 0]", self.colour(0, 0.8), self.colour(0, 0.1)])
        kind, ends = '"string type" ["homogeneous"]', ("", "")
        if self.uneven is not None:
            kind, ends = self.grid()
        self.write(f'{ends[0]}MakeNamedMedium "{name}" {kind} '
                   f'"rgb sigma_a" {absorption} "rgb sigma_s" {scattering} '
                   f'"float scale" [{density}] "float g" [{self.random.uniform(-0.5, 0.8):.2f}]'
                   f'{ends[1]}')
        return name

    def grid(self):
        """Random densities in a turned box, which may be smaller than what it fills."""
        size = [self.uneven.randint(1, 7) for _ in range(3)]
        values = [0 if self.uneven.random() < 0.3 else self.uneven.expovariate(1)
                  for _ in range(size[0] * size[1] * size[2])]
        low, high = ([sign * self.uneven.uniform(0.7, 3) for _ in range(3)] for sign in (-1, 1))
        turn = (f"AttributeBegin Translate 0 {self.uneven.uniform(0, 1):.2f} 0 "
                f"Rotate {self.uneven.uniform(0, 360):.1f} {self.uneven.random():.2f} 1 .3\n")
        is_in_world = any("WorldBegin" in line for line in self.lines)
        text = '"string type" ["uniformgrid"] '
        text += " ".join(f'"integer n{axis}" [{n}]' for axis, n in zip("xyz", size))
        for corner, place in (("p0", low), ("p1", high)):
            text += f' "point3 {corner}" [{" ".join(f"{c:.3f}" for c in place)}]'
        text += f'\n"float density" [{" ".join(f"{v:.3g}" for v in values)}]\n'
        return text, (turn, "\nAttributeEnd") if is_in_world else ("", "")

    def begin(self):
        """An object's attributes, with the medium around it."""
        self.write("AttributeBegin")
        if self.room_medium:
            self.write(f'MediumInterface "{self.room_medium}" "{self.room_medium}"')

    def place(self, radius, quarter=None):
        x, z = self.random.uniform(-0.6, 0.6), self.random.uniform(-0.6, 0.5)
        if quarter is not None:
            x, z = quarter
        axis = f"{self.random.random():.2f} 1 {self.random.random():.2f}"
        return (f"Translate {x:.3f} {radius + 0.02:.3f} {z:.3f}\n"
                f"Rotate {self.random.uniform(0, 360):.1f} {axis}")

    def filled(self):
        """Glass or an interface with a medium inside."""
        medium = self.medium(absorbs_alone=self.random.random() < 0.3)
        radius = self.random.uniform(0.2, 0.45)
        quarter = self.quarters.pop()
        kind = self.random.choice(["dielectric", "dielectric", "interface"])
        material = self.name("material")
        parameters = "" if kind == "interface" else f"{self.index()} {self.roughness(smooth=0.6)}"
        self.write(f'MakeNamedMaterial "{material}" "string type" ["{kind}"] {parameters}')
        self.write(f'AttributeBegin\n{self.place(radius, quarter)}\n'
                   f'MediumInterface "{medium}" "{self.room_medium}"\nNamedMaterial "{material}"')
        if self.random.random() < 0.6:
            self.write(f'Shape "sphere" "float radius" [{radius:.3f}]')
        else:
            self.box("trianglemesh", radius * 0.55)
        self.write("AttributeEnd")
        if self.random.random() < 0.3:
            self.small_sphere(medium)

    def small_sphere(self, medium):
        """On the floor, maybe within what is filled."""
        material = self.material(["diffuse", "conductor"])
        self.write(f'AttributeBegin\nMediumInterface "{medium}" "{medium}"\n'
                   f'NamedMaterial "{material}"\n{self.place(0.08)}\n'
                   'Shape "sphere" "float radius" [.08]\nAttributeEnd')

    def strands(self):
        """Curves of hair or of another material."""
        if self.random.random() < 0.6:
            material = self.name("material")
            colour = self.random.choice([
                f'"rgb sigma_a" {self.colour(0.05, 1)}', '"float eumelanin" [.8]',
                f'"rgb reflectance" {self.colour(0.2, 0.9)}'])
            self.write(f'MakeNamedMaterial "{material}" "string type" ["hair"] {colour} '
                       f'"float beta_m" [{self.random.uniform(0.2, 0.6):.2f}] '
                       f'"float beta_n" [{self.random.uniform(0.2, 0.6):.2f}]')
        else:
            material = self.material(["diffuse", "conductor", "coateddiffuse"])
        kind = self.random.choice(["flat", "cylinder"])
        self.begin()
        self.write(f'{self.place(0.1)}\nNamedMaterial "{material}"')
        for _ in range(self.random.randint(10, 60)):
            x, z = self.random.uniform(-0.2, 0.2), self.random.uniform(-0.2, 0.2)
            points = " ".join(
                f"{x + self.random.uniform(-.1, .1):.3f} {0.2 * i:.3f} "
                f"{z + self.random.uniform(-.1, .1):.3f}" for i in range(4))
            self.write(f'Shape "curve" "string type" ["{kind}"] "point3 P" [{points}] '
                       f'"float width0" [{self.random.uniform(0.01, 0.04):.3f}] '
                       f'"float width1" [{self.random.uniform(0.005, 0.02):.3f}]')
        self.write("AttributeEnd")

    def instances(self):
        material = self.material(OBJECTS)
        name = self.name("object")
        self.begin()
        self.write(f'ObjectBegin "{name}"\nNamedMaterial "{material}"')
        if self.random.random() < 0.5:
            self.box("trianglemesh", 0.08)
        else:
            self.write('Shape "sphere" "float radius" [.1]')
        self.write("ObjectEnd\nAttributeEnd")
        for _ in range(self.random.randint(2, 6)):
            stretch = " ".join(f"{self.random.uniform(0.5, 1.6):.2f}" for _ in range(3))
            mirror = "Scale -1 1 1\n" if self.random.random() < 0.3 else ""
            self.write(f'AttributeBegin\n{self.place(0.15)}\nScale {stretch}\n{mirror}'
                       f'ObjectInstance "{name}"\nAttributeEnd')

    def smooth_mesh(self):
        """A subdivided box, a part of a sphere, or an icosahedron-like mesh with normals."""
        material = self.material(OBJECTS)
        radius = self.random.uniform(0.2, 0.4)
        self.begin()
        self.write(f'{self.place(radius)}\nNamedMaterial "{material}"')
        kind = self.random.choice(["loopsubdiv", "part", "normals"])
        if kind == "loopsubdiv":
            self.box("loopsubdiv", radius * 0.6)
        elif kind == "part":
            self.write(f'Shape "sphere" "float radius" [{radius:.3f}] '
                       f'"float zmin" [{-radius * self.random.random():.3f}] '
                       f'"float phimax" [{self.random.uniform(120, 360):.0f}]')
        else:
            rows, columns = 24, 48
            normals, points, indices = [], [], []
            for i in range(rows + 1):
                theta = math.pi * i / rows
                for j in range(columns + 1):
                    phi = 2 * math.pi * j / columns
                    n = (math.sin(theta) * math.cos(phi), math.cos(theta),
                         -math.sin(theta) * math.sin(phi))
                    normals += [f"{c:.5f}" for c in n]
                    points += [f"{radius * c:.5f}" for c in n]
            for i in range(rows):
                for j in range(columns):
                    a = i * (columns + 1) + j
                    b = a + columns + 1
                    if i > 0:
                        indices += [a, b, a + 1]
                    if i < rows - 1:
                        indices += [a + 1, b, b + 1]
            self.write(f'Shape "trianglemesh" "point3 P" [{" ".join(points)}] '
                       f'"normal N" [{" ".join(normals)}] '
                       f'"integer indices" [{" ".join(map(str, indices))}]')
        self.write("AttributeEnd")

    def lights(self, is_open):
        """One to three; `is_open`: light from infinity reaches the room."""
        kinds = ["rectangle", "sphere", "picture"] + (["sky", "map"] * 2 if is_open else [])
        # A path tracer that samples BSDFs alone rarely finds these.
        if self.random.random() < 0.25:
            kinds = ["point", "spot", "goniometric", "projection"] + (["distant"] if is_open else [])
        # What stands for a point has a size in the path tracer: no light may be in another one.
        thirds = self.random.sample([-0.6, 0, 0.6], 3)
        for third, kind in zip(thirds, self.random.sample(kinds, self.random.randint(1, 3))):
            x = third + self.random.uniform(-0.1, 0.1)
            place = (f"{x:.2f} {self.random.uniform(1.4, 1.8):.2f} "
                     f"{self.random.uniform(-.5, .5):.2f}")
            self.write("AttributeBegin")
            if self.room_medium:
                self.write(f'MediumInterface "{self.room_medium}" "{self.room_medium}"')
            scale = f'"float scale" [{self.random.uniform(0.5, 3):.2f}]'
            unit = self.random.choice([scale, f'"float power" [{self.random.uniform(5, 30):.1f}]'])
            if kind == "point":
                self.write(f'LightSource "point" "point3 from" [{place}] "rgb I" '
                           f"{self.colour()} {unit}")
            elif kind == "spot":
                self.write(f'LightSource "spot" "point3 from" [{place}] "point3 to" '
                           f'[{self.random.uniform(-.5, .5):.2f} 0 0] "float coneangle" '
                           f'[{self.random.uniform(20, 60):.0f}] "float conedeltaangle" [10] '
                           f"{unit}")
            elif kind == "goniometric":
                self.write(f"Translate {place}\nRotate 30 1 1 0\n"
                           f'LightSource "goniometric" "string filename" ["picture.pfm"] {unit}')
            elif kind == "projection":
                self.write(f"Translate {place}\nRotate 90 1 0 0\n"
                           f'LightSource "projection" "string filename" ["picture.pfm"] '
                           f'"float fov" [{self.random.uniform(40, 80):.0f}] {unit}')
            elif kind == "distant":
                self.write('LightSource "distant" "point3 from" '
                           f'[{self.random.uniform(-.5, .5):.2f} 1 {self.random.uniform(.1, .8):.2f}]'
                           f' "point3 to" [0 0 0] {scale}')
            elif kind == "sky":
                self.write(f'LightSource "infinite" "rgb L" {self.colour(0.3, 1.5)}')
            elif kind == "map":
                self.write(f"Rotate {self.random.uniform(0, 360):.0f} 1 1 0\n"
                           f'LightSource "infinite" "string filename" ["picture.pfm"] {scale}')
            else:
                self.emitting_shape(kind, x)
            self.write("AttributeEnd")

    def emitting_shape(self, kind, x):
        black = self.name("material")
        self.write(f'MakeNamedMaterial "{black}" "string type" ["diffuse"] '
                   '"rgb reflectance" [0 0 0]')
        what = f'"rgb L" {self.colour(3, 9)}'
        if kind == "picture":
            what = f'"string filename" ["picture.pfm"] "float scale" [{self.random.uniform(3, 9):.1f}]'
        elif self.random.random() < 0.3:
            what = f'"blackbody L" [{self.random.uniform(2500, 9000):.0f}] "float power" [20]'
        sides = ' "bool twosided" [true]' if self.random.random() < 0.3 else ""
        alpha = self.mask(1)
        self.write(f'NamedMaterial "{black}"\nAreaLightSource "diffuse" {what}{sides}')
        z = self.random.uniform(-.4, .4)
        if kind == "sphere":
            self.write(f'Translate {x:.2f} 1.6 {z:.2f}\nShape "sphere" "float radius" [.15]{alpha}')
        else:
            turn = self.random.uniform(-30, 30)
            self.write(f"Translate {x:.2f} 1.7 {z:.2f}\nRotate {turn:.0f} 1 0 1\n"
                       'Shape "bilinearmesh" "point3 P" '
                       f"[-.2 0 .3  -.2 0 -.3  .2 0 .3  .2 0 -.3]{alpha}")

    def text(self):
        is_open = self.random.random() < 0.4
        # Light from infinity begins in empty space: no fog without a border under it.
        has_fog = not is_open and self.random.random() < 0.3
        eye = (f"{self.random.uniform(-0.3, 0.3):.2f} {self.random.uniform(0.8, 1.3):.2f} "
               f"{self.random.uniform(2.4, 2.8) if is_open else 0.95:.2f}")
        self.write(f"LookAt {eye}  0 .7 -.3  0 1 0")
        if has_fog:
            self.room_medium = self.medium()
            self.write(f'MediumInterface "{self.room_medium}" "{self.room_medium}"')
        self.write(f'Camera "perspective" "float fov" [{50 if is_open else 85}]\n'
                   'Film "rgb" "integer xresolution" [32] "integer yresolution" [32]\n'
                   'PixelFilter "box"\nIntegrator "sppm" "integer maxdepth" [100]\nWorldBegin')
        walls = [self.material(WALLS) for _ in range(3)]
        if self.room_medium:
            self.write(f'MediumInterface "{self.room_medium}" "{self.room_medium}"')
        self.wall(walls[0], "-1 0 1  1 0 1  -1 0 -1  1 0 -1")
        self.wall(walls[1], "-1 0 -1  1 0 -1  -1 2 -1  1 2 -1")
        self.wall(walls[2], "-1 0 1  -1 0 -1  -1 2 1  -1 2 -1")
        if not is_open:
            self.wall(self.random.choice(walls), "1 0 -1  1 0 1  1 2 -1  1 2 1")
            self.wall(walls[0], "-1 2 -1  1 2 -1  -1 2 1  1 2 1")
            self.wall(self.random.choice(walls), "1 0 1  -1 0 1  1 2 1  -1 2 1")
        self.lights(is_open)
        objects = [self.object, self.filled, self.filled, self.strands, self.instances,
                   self.smooth_mesh]
        for write in self.random.sample(objects, self.random.randint(2, 4)):
            write()
        return "\n".join(self.lines) + "\n"


def picture(side=16):
    """Square, in colour, brighter in a corner, as PFM."""
    rows = []
    for y in range(side):
        for x in range(side):
            bright = 4 if x < side // 4 and y < side // 3 else 0.3 + 0.7 * ((x + y) % 2)
            rows += [bright, bright * x / side, bright * 0.5]
    return f"PF\n{side} {side}\n-1\n".encode() + struct.pack(f"<{len(rows)}f", *rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("first", type=int)
    parser.add_argument("last", type=int)
    parser.add_argument("--more", action="store_true")
    parser.add_argument("--uneven", action="store_true")
    parser.add_argument("--masked", action="store_true")
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    if arguments.more:
        (arguments.folder / "picture.pfm").write_bytes(picture())
    for number in range(arguments.first, arguments.last + 1):
        room = Room(number)
        if arguments.more:
            room = RoomWithMore(number, arguments.uneven, arguments.masked)
        (arguments.folder / f"room-{number}.pbrt").write_text(room.text())


if __name__ == "__main__":
    main()
