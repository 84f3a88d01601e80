#!/usr/bin/env python3
"""Random glTF rooms, rendered by Lucerna and by Cycles, another reader and another renderer.

  compare_with_cycles.py FOLDER_OF_PROGRAMS FIRST LAST [--keep FOLDER]

Prints a row for each room: what is in it, the ratio of the means of the three channels (Lucerna over
Cycles, pixels clipped at 5) and quantiles of the ratio of green over blocks of 8 x 8 pixels. Needs
Blender 3.4 (`apt-get install blender`); exits with 77 where it is missing.

Rooms have nested and mirrored nodes, matrices, strips and fans, morph targets, colours of vertices,
textures with every way of repetition and KHR_texture_transform, masks, blends, metal, glass, emissive
textures and lights. Cycles gets the shaders of glTF's specification in place of those that Blender's
importer makes (which differ on purpose), floats in place of 8-bit sRGB pixels (it interpolates
these before it decodes them), masks as such, lights without a radius, and the nodes that this
importer joins wrongly joined. What still differs: Lucerna mixes light in P3, Cycles in Rec. 709, so
that what saturated walls reflect to each other differs by up to a tenth; Cycles' spot lights fade
by the cosine, so there are none; metal has no Fresnel in Cycles.
"""
import argparse
import base64
import math
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile

SIDE = 64
PASSES = 64
PATHS = 1024


# ---- rooms

def turned(axis, angle):
    length = math.sqrt(sum(x * x for x in axis))
    return [x / length * math.sin(angle / 2) for x in axis] + [math.cos(angle / 2)]


def product(a, b):
    x1, y1, z1, w1 = a
    x2, y2, z2, w2 = b
    return [w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2, w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
            w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2, w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2]


def matrix(turn, place, scale):
    x, y, z, w = turn
    rows = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    columns = []
    for c in range(3):
        columns += [rows[r][c] * scale[c] for r in range(3)] + [0]
    return columns + [*place, 1]


class Room:
    MATERIALS = ["matte", "textured", "mask", "blend", "even blend", "metal", "glass", "mix"]

    def __init__(self, seed):
        import make_gltf_scenes as gltf
        self.gltf = gltf
        self.random = random.Random(seed)
        self.document = gltf.Document()
        self.names = []
        for array in ("images", "textures", "samplers"):
            self.document.json[array] = []
        self.walls()
        for _ in range(self.random.choice([3, 4, 5])):
            self.thing()
        self.lights()
        self.camera()
        self.document.use()

    def between(self, least, largest):
        return self.random.uniform(least, largest)

    def color(self, least=0.2, largest=0.9):
        return [self.between(least, largest) for _ in range(3)]

    def texture(self, has_opacity=False, is_linear=False):
        pick = self.random
        width, height = pick.choice([4, 6, 8]), pick.choice([4, 8])
        pixels = bytearray()
        for _ in range(width * height):
            opacity = pick.choice([0, 80, 128, 140, 255]) if has_opacity else 255
            pixels += bytes([pick.randrange(60, 256) for _ in range(3)] + [opacity])
        encoded = base64.b64encode(self.gltf.png(width, height, bytes(pixels))).decode()
        image = self.document.add("images", {"uri": "data:image/png;base64," + encoded})
        sampler = {"wrapS": pick.choice([10497, 33648, 33071]),
                   "wrapT": pick.choice([10497, 33648, 33071])}
        if not is_linear and pick.random() < 0.8:
            sampler.update({"magFilter": 9728, "minFilter": 9728})
        texture = {"source": image, "sampler": self.document.add("samplers", sampler)}
        info = {"index": self.document.add("textures", texture)}
        if pick.random() < 0.6:
            info["extensions"] = {"KHR_texture_transform": {
                "offset": [self.between(-1, 1), self.between(-1, 1)],
                "rotation": self.between(-3, 3),
                "scale": [self.between(0.4, 2.5) * pick.choice([1, 1, -1]),
                          self.between(0.4, 2.5)]}}
        return info

    def material(self, kind):
        self.names.append(kind)
        pbr = self.gltf.pbr(self.color(), 0, 1)
        extensions = {"KHR_materials_specular": {"specularFactor": 0}}
        entry = {"name": kind, "doubleSided": True, "pbrMetallicRoughness": pbr,
                 "extensions": extensions}
        if kind == "textured":
            pbr["baseColorTexture"] = self.texture()
        elif kind == "mask":
            pbr["baseColorTexture"] = self.texture(has_opacity=True)
            entry.update({"alphaMode": "MASK",
                          "alphaCutoff": self.random.choice([0.3, 0.5, 0.7])})
        elif kind == "blend":
            pbr["baseColorTexture"] = self.texture(has_opacity=True)
            pbr["baseColorFactor"][3] = self.between(0.4, 1)
            entry["alphaMode"] = "BLEND"
        elif kind == "even blend":
            pbr["baseColorFactor"][3] = self.between(0.3, 0.9)
            entry["alphaMode"] = "BLEND"
        elif kind == "metal":
            entry["pbrMetallicRoughness"] = self.gltf.pbr(self.color(0.7, 1), 1,
                                                          self.between(0.15, 0.6))
        elif kind == "mix":
            pbr["metallicFactor"] = self.between(0.2, 0.8)
            pbr["roughnessFactor"] = self.between(0.3, 0.6)
        elif kind == "glass":
            entry["pbrMetallicRoughness"] = self.gltf.pbr(
                [1, 1, 1], 0, self.random.choice([0, 0, self.between(0.2, 0.6)]))
            entry["extensions"] = {"KHR_materials_transmission": {"transmissionFactor": 1},
                                   "KHR_materials_ior": {"ior": self.between(1.2, 1.8)},
                                   "KHR_materials_volume": {"thicknessFactor": 1}}
        elif kind in ("light", "textured light"):
            pbr["baseColorFactor"] = [0, 0, 0, 1]
            entry["emissiveFactor"] = self.color(0.3, 1)
            extensions["KHR_materials_emissive_strength"] = {
                "emissiveStrength": self.between(3, 20)}
            if kind == "textured light":
                entry["emissiveTexture"] = self.texture(is_linear=True)
        return self.document.add("materials", entry)

    def walls(self):
        quad = self.gltf.quad
        for corner, u, v, repeats in (([-2, 0, 2], [4, 0, 0], [0, 0, -4], 2),
                                      ([-2, 4, -2], [4, 0, 0], [0, 0, 4], 2),
                                      ([-2, 0, -2], [4, 0, 0], [0, 4, 0], 3),
                                      ([2, 0, 2], [-4, 0, 0], [0, 4, 0], 1),
                                      ([-2, 0, 2], [0, 0, -4], [0, 4, 0], 1),
                                      ([2, 0, -2], [0, 0, 4], [0, 4, 0], 1.5)):
            material = self.material(self.random.choice(["matte", "textured"]))
            self.document.node(
                {"mesh": self.document.mesh("wall", quad(corner, u, v, repeats), material)})

    def thing(self):
        pick, document = self.random, self.document
        kind = pick.choice(self.MATERIALS)
        form = "ball" if kind == "glass" else pick.choice(["ball", "box", "quad", "strip", "fan"])
        if form == "ball":
            shape = self.gltf.sphere(0.5, 48, 32)
            uvs = [[column / 24, row / 32] for row in range(33) for column in range(49)]
            shape = (shape[0], shape[1], uvs, shape[3])
        elif form == "box":
            shape = self.gltf.box([self.between(0.3, 0.6) for _ in range(3)])
        else:
            shape = self.gltf.quad([-0.6, -0.6, 0], [1.2, 0, 0], [0, 1.2, 0], 2)
        mesh = document.mesh(form, shape, self.material(kind))
        primitive = document.json["meshes"][mesh]["primitives"][0]
        if form in ("strip", "fan"):
            order = [0, 1, 3, 2] if form == "strip" else [0, 1, 2, 3]
            primitive.update({"mode": 5 if form == "strip" else 6,
                              "indices": document.accessor(order, "SCALAR", 5121)})
        if kind != "glass" and pick.random() < 0.3:
            colors = [x for _ in shape[0] for x in self.color(0.3, 1)]
            primitive["attributes"]["COLOR_0"] = document.accessor(colors, "VEC3")
        if pick.random() < 0.3:
            moves = [x for p in shape[0] for x in (0.5 * p[0], 0, 0.2 * p[2])]
            primitive["targets"] = [{"POSITION": document.accessor(moves, "VEC3")}]
            document.json["meshes"][mesh]["weights"] = [self.between(-0.6, 0.9)]
        turn = turned(self.color(-1, 1), self.between(-3, 3))
        scale = [self.between(0.6, 1.3) * pick.choice([1, 1, 1, -1]) for _ in range(3)]
        if kind == "glass":
            scale = [self.between(0.7, 1.2)] * 3
        place = [self.between(-1.2, 1.2), self.between(0.7, 2.6), self.between(-1.2, 0.8)]
        if pick.random() < 0.5:
            document.node({"mesh": mesh, "matrix": matrix(turn, place, scale)})
        else:
            child = document.add("nodes", {"mesh": mesh, "rotation": turn, "scale": scale})
            document.node({"children": [child], "translation": place,
                           "rotation": turned([0, 1, 0], self.between(-3, 3)),
                           "scale": [self.between(0.8, 1.2)] * 3})

    def lights(self):
        document = self.document
        panel = self.gltf.quad([self.between(-1.5, 0.3), 3.9, self.between(-1.5, 0.3)],
                               [1.2, 0, 0], [0, 0, 1.2])
        material = self.material(self.random.choice(["light", "textured light"]))
        document.node({"mesh": document.mesh("panel", panel, material)})
        # Paths of Cycles do not find a point through smooth glass.
        if "glass" in self.names or self.random.random() < 0.3:
            return
        self.names.append("point")
        light = {"type": "point", "intensity": self.between(1000, 8000),
                 "color": self.color(0.4, 1)}
        document.json["extensions"] = {"KHR_lights_punctual": {"lights": [light]}}
        document.node({"translation": [self.between(-1, 1), 3.4, self.between(-1, 1)],
                       "scale": [self.between(0.5, 2)] * 3,
                       "extensions": {"KHR_lights_punctual": {"light": 0}}})

    def camera(self):
        self.document.json["cameras"] = [{"type": "perspective", "perspective": {
            "yfov": self.between(0.8, 1.2), "aspectRatio": 1, "znear": 0.01}}]
        eye = [self.between(-1, 1), self.between(1, 3), 1.95]
        look = self.gltf.look(eye, [self.between(-0.4, 0.4), self.between(1.2, 1.8), -0.5])
        roll = turned([0, 0, 1], self.between(-0.5, 0.5))
        self.document.node({"translation": eye, "rotation": product(look, roll), "camera": 0})


# ---- in Blender

def follow_the_specification(material, floats):
    """Gives a material of the importer the shaders that glTF's specification has."""
    tree = material.node_tree
    principled = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    for link in list(tree.links):
        mix = link.from_node
        if mix.type == "MIX" and mix.data_type == "RGBA" and link.from_socket == mix.outputs[0]:
            target = link.to_socket
            tree.links.remove(link)
            tree.links.new(mix.outputs[2], target)
    for node in tree.nodes:
        if node.type == "TEX_IMAGE" and node.image.colorspace_settings.name == "sRGB":
            node.image = floats(node.image)

    def feed(name, socket):
        given = principled.inputs[name]
        if given.is_linked:
            tree.links.new(given.links[0].from_socket, socket)
        else:
            socket.default_value = given.default_value

    def is_there(name):
        return principled.inputs[name].is_linked or principled.inputs[name].default_value > 0

    def shader(kind, **inputs):
        node = tree.nodes.new("ShaderNode" + kind)
        for name, source in inputs.items():
            feed(source, node.inputs[name])
        return node

    def mix(name, without, within):
        node = tree.nodes.new("ShaderNodeMixShader")
        feed(name, node.inputs[0])
        tree.links.new(without, node.inputs[1])
        tree.links.new(within, node.inputs[2])
        return node

    out = shader("BsdfDiffuse", Color="Base Color").outputs[0]
    if is_there("Transmission"):
        glass = shader("BsdfGlass", Color="Base Color", Roughness="Roughness", IOR="IOR")
        glass.distribution = "GGX"
        out = mix("Transmission", out, glass.outputs[0]).outputs[0]
    if is_there("Metallic"):
        metal = shader("BsdfGlossy", Color="Base Color", Roughness="Roughness")
        metal.distribution = "GGX"
        out = mix("Metallic", out, metal.outputs[0]).outputs[0]
    emission = shader("Emission", Color="Emission", Strength="Emission Strength")
    both = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(out, both.inputs[0])
    tree.links.new(emission.outputs[0], both.inputs[1])
    out = both.outputs[0]
    alpha = principled.inputs["Alpha"]
    if alpha.is_linked or alpha.default_value < 1:
        node = mix("Alpha", tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0], out)
        if material.blend_method == "CLIP":
            step = tree.nodes.new("ShaderNodeMath")
            step.operation = "GREATER_THAN"
            feed("Alpha", step.inputs[0])
            step.inputs[1].default_value = material.alpha_threshold
            tree.links.new(step.outputs[0], node.inputs[0])
        out = node.outputs[0]
    surface = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(out, surface.inputs["Surface"])


def compare_in_blender(room, ours, rendered):
    import bpy
    import numpy
    numpy.bool = bool  # which the importer still asks for
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=room)
    made = {}

    def floats(image):
        if image.name not in made:
            pixels = numpy.array(image.pixels[:], dtype=numpy.float32).reshape(-1, 4)
            coded = pixels[:, :3]
            pixels[:, :3] = numpy.where(coded <= 0.04045, coded / 12.92,
                                        ((coded + 0.055) / 1.055) ** 2.4)
            new = bpy.data.images.new(image.name, *image.size, alpha=True, float_buffer=True)
            new.colorspace_settings.name = "Non-Color"
            new.alpha_mode = "CHANNEL_PACKED"
            new.pixels[:] = pixels.ravel().tolist()
            new.pack()
            made[image.name] = new
        return made[image.name]

    for material in bpy.data.materials:
        if material.use_nodes:
            follow_the_specification(material, floats)
    for light in bpy.data.lights:
        light.shadow_soft_size = 0
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("black")
    scene.world.color = (0, 0, 0)
    scene.camera = next(thing for thing in bpy.data.objects if thing.type == "CAMERA")
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    cycles.samples = PATHS
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 32
    cycles.transmission_bounces = cycles.transparent_max_bounces = 32
    cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    cycles.pixel_filter_type = "BOX"
    render.resolution_x = render.resolution_y = SIDE
    render.resolution_percentage = 100
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    render.filepath = rendered
    bpy.ops.render.render(write_still=True)

    loaded = bpy.data.images.load(rendered)
    theirs = numpy.array(loaded.pixels[:]).reshape(SIDE, SIDE, 4)[..., :3]
    # Both from the lowest row up.
    pfm = pathlib.Path(ours).read_bytes()
    ours = numpy.frombuffer(pfm[-12 * SIDE * SIDE:], "<f4").reshape(SIDE, SIDE, 3)
    ours, theirs = numpy.minimum(ours, 5), numpy.minimum(theirs, 5)
    blocks = [image[..., 1].reshape(SIDE // 8, 8, SIDE // 8, 8).mean((1, 3))
              for image in (ours, theirs)]
    ratio = blocks[0] / blocks[1]
    print("RATIO", *(f"{x:.3f}" for x in ours.mean((0, 1)) / theirs.mean((0, 1))), "blocks",
          *(f"{x:.3f}" for x in numpy.quantile(ratio, [0.1, 0.5, 0.9])))


# ---- outside of it

def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", type=pathlib.Path)
    parser.add_argument("first", type=int)
    parser.add_argument("last", type=int)
    parser.add_argument("--keep", type=pathlib.Path, help="a folder for rooms and images")
    arguments = parser.parse_args()
    if shutil.which("blender") is None:
        print("skipped: blender is not installed")
        return 77
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.keep or pathlib.Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for seed in range(arguments.first, arguments.last + 1):
            room = Room(seed)
            path = folder / f"room-{seed}.glb"
            path.write_bytes(room.document.glb())
            image, ours = folder / f"room-{seed}.exr", folder / f"room-{seed}.pfm"
            subprocess.run([arguments.programs / "lucerna", "render", path, "--size",
                            f"{SIDE}x{SIDE}", "--passes", str(PASSES), "--max-depth", "33",
                            "--spectral=false", "--quiet", "--force", "--no-checkpoints", "-o",
                            image], check=True)
            subprocess.run([arguments.programs / "lucerna", "png", image, ours], check=True,
                           capture_output=True)
            said = subprocess.run(
                ["blender", "--background", "--factory-startup", "--python", __file__, "--",
                 "in-blender", path, ours, folder / f"room-{seed}-cycles.exr"],
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=True).stdout
            ratio = next((line for line in said.splitlines() if line.startswith("RATIO")), None)
            if ratio is None:
                sys.exit("\n".join(said.splitlines()[-20:]))
            print(seed, ratio.removeprefix("RATIO "), ", ".join(room.names[6:]), flush=True)
    return 0


if __name__ == "__main__":
    if "in-blender" in sys.argv:
        compare_in_blender(*sys.argv[sys.argv.index("in-blender") + 1:])
    else:
        sys.exit(main())
