#!/usr/bin/env python3
"""Random rooms of all kinds of surfaces, for comparing the estimator with a path tracer.

  tests/tools/make_material_scenes.py FOLDER FIRST LAST

Writes room-N.pbrt for the numbers FIRST to LAST, pbrt files without other files. The same call
writes the same bytes. Walls and objects have random materials with random parameters, textures,
mixes and bumps; light comes from one area light or from all around, so that a path tracer finds it.
`lucerna-path-check` compares them. No media, no light below surfaces, no hair: what the path tracer
does not know, or knows on planes alone.
"""
import argparse
import pathlib
import random

METALS = ["Cu", "Al", "Au"]
OBJECTS = ["diffuse", "conductor", "dielectric", "thindielectric", "coateddiffuse",
           "coatedconductor", "diffusetransmission", "mix"]
WALLS = ["diffuse", "diffuse", "coateddiffuse", "conductor", "coatedconductor",
         "diffusetransmission"]


class Room:
    """The text of one scene."""

    def __init__(self, number):
        self.random = random.Random(number)
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

    def roughness(self, prefix="", smooth=0.25):
        """Smooth, one number, one for each direction, or a texture."""
        kind = self.random.random()
        if kind < smooth:
            return ""
        remap = ' "bool remaproughness" [false]' if self.random.random() < 0.3 else ""
        number = f"[{self.random.uniform(0.02, 0.6):.3f}]"
        if kind < 0.6:
            return f'"float {prefix}roughness" {number}{remap}'
        if kind < 0.8:
            other = f"[{self.random.uniform(0.02, 0.6):.3f}]"
            return f'"float {prefix}uroughness" {number} "float {prefix}vroughness" {other}{remap}'
        return f'"texture {prefix}roughness" ["{self.number_texture(0.02, 0.6)}"]{remap}'

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
            interface = self.roughness("interface.")
            conductor = "" if "texture" in interface else self.roughness("conductor.")
            colour = f'"rgb reflectance" {self.colour(0.2, 0.95)}'
            parameters = [self.random.choice([self.metal("conductor."), colour]), interface,
                          conductor, self.index("interface.eta"),
                          f'"float thickness" [{self.random.choice([0.01, 0.1, 0.5])}]',
                          self.haze(0.3)]
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
            self.write(f'Shape "sphere" "float radius" [{radius:.3f}]{alpha}')
        elif kind == "cylinder":
            half = f"{radius * 0.7:.3f}"
            self.write(f'Shape "cylinder" "float radius" [{radius * 0.6:.3f}] '
                       f'"float zmin" [-{half}] "float zmax" [{half}]')
        elif kind == "disk":
            self.write(f'Shape "disk" "float radius" [{radius:.3f}] '
                       f'"float innerradius" [{radius * 0.3:.3f}]')
        else:
            corners = [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
            points = " ".join(f"{c * radius * 0.55:.3f}" for corner in corners for c in corner)
            self.write(f'Shape "trianglemesh" "point3 P" [{points}] "integer indices" '
                       "[0 2 1 1 2 3 4 5 6 5 7 6 0 1 4 1 5 4 2 6 3 3 6 7 0 4 2 2 4 6 1 3 5 3 7 5]")
        self.write("AttributeEnd")

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


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("first", type=int)
    parser.add_argument("last", type=int)
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    for number in range(arguments.first, arguments.last + 1):
        (arguments.folder / f"room-{number}.pbrt").write_text(Room(number).text())


if __name__ == "__main__":
    main()
