#!/usr/bin/env python3
"""Writes tests/scenes/still-life.gltf with its buffer, and the seeds of the fuzz target `gltf`.

A room with a glass ball, a brass ring, a lacquered block, a frosted bottle-green block of glass, an
emissive lamp and a spot light: the ball and the ring draw caustics on the floor. The numbers are
those of this script; running it again writes the same bytes.

Usage: make_gltf_scenes.py [FOLDER]   (of tests/, by default the one it lies in)
"""

import base64
import json
import math
import pathlib
import struct
import sys
import zlib


class Document:
    """A glTF document whose arrays go into one buffer."""

    def __init__(self):
        self.json = {"asset": {"version": "2.0", "generator": "tests/tools/make_gltf_scenes.py"},
                     "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [],
                     "materials": [], "accessors": [], "bufferViews": []}
        self.buffer = b""

    def view(self, data):
        self.buffer += b"\0" * (-len(self.buffer) % 4)
        self.json["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(data)})
        self.buffer += data
        return len(self.json["bufferViews"]) - 1

    def accessor(self, numbers, kind, component=5126):
        size = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}[kind]
        code = {5126: "f", 5123: "H", 5121: "B", 5120: "b"}[component]
        entry = {"bufferView": self.view(struct.pack(f"<{len(numbers)}{code}", *numbers)),
                 "componentType": component, "count": len(numbers) // size, "type": kind}
        if kind == "VEC3" and component == 5126:
            entry["min"] = [min(numbers[i::3]) for i in range(3)]
            entry["max"] = [max(numbers[i::3]) for i in range(3)]
        self.json["accessors"].append(entry)
        return len(self.json["accessors"]) - 1

    def add(self, array, entry):
        self.json.setdefault(array, []).append(entry)
        return len(self.json[array]) - 1

    def mesh(self, name, shape, material):
        positions, normals, uvs, indices = shape
        attributes = {"POSITION": self.accessor([x for p in positions for x in p], "VEC3"),
                      "NORMAL": self.accessor([x for n in normals for x in n], "VEC3")}
        if uvs:
            attributes["TEXCOORD_0"] = self.accessor([x for t in uvs for x in t], "VEC2")
        primitive = {"attributes": attributes, "material": material,
                     "indices": self.accessor(indices, "SCALAR", 5123)}
        return self.add("meshes", {"name": name, "primitives": [primitive]})

    def node(self, entry):
        self.json["scenes"][0]["nodes"].append(self.add("nodes", entry))

    def use(self):
        """Lists the extensions that are there."""
        text = json.dumps(self.json)
        names = ["EXT_mesh_gpu_instancing", "KHR_lights_punctual", "KHR_materials_emissive_strength",
                 "KHR_materials_ior", "KHR_materials_transmission", "KHR_materials_volume",
                 "KHR_texture_transform"]
        self.json["extensionsUsed"] = [name for name in names if name in text]

    def text(self, uri):
        self.json["buffers"] = [{"uri": uri, "byteLength": len(self.buffer)}]
        return (json.dumps(self.json, indent=1) + "\n").encode()

    def glb(self):
        self.json["buffers"] = [{"byteLength": len(self.buffer)}]
        text = json.dumps(self.json, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        binary = self.buffer + b"\0" * (-len(self.buffer) % 4)
        chunks = (struct.pack("<I", len(text)) + b"JSON" + text +
                  struct.pack("<I", len(binary)) + b"BIN\0" + binary)
        return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


def quad(corner, along_u, along_v, repeats=1):
    """Faces along the cross product of its edges."""
    normal = [along_u[1] * along_v[2] - along_u[2] * along_v[1],
              along_u[2] * along_v[0] - along_u[0] * along_v[2],
              along_u[0] * along_v[1] - along_u[1] * along_v[0]]
    length = math.sqrt(sum(x * x for x in normal))
    normal = [x / length for x in normal]
    positions = [[corner[i] + a * along_u[i] + b * along_v[i] for i in range(3)]
                 for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
    uvs = [[a * repeats, (1 - b) * repeats] for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
    return positions, [normal] * 4, uvs, [0, 1, 2, 0, 2, 3]


def joined(shapes):
    positions, normals, uvs, indices = [], [], [], []
    for shape in shapes:
        indices += [i + len(positions) for i in shape[3]]
        positions += shape[0]
        normals += shape[1]
        uvs += shape[2]
    return positions, normals, uvs, indices


def box(half):
    x, y, z = half
    return joined([quad([-x, -y, z], [2 * x, 0, 0], [0, 2 * y, 0]),
                   quad([x, -y, -z], [-2 * x, 0, 0], [0, 2 * y, 0]),
                   quad([x, -y, z], [0, 0, -2 * z], [0, 2 * y, 0]),
                   quad([-x, -y, -z], [0, 0, 2 * z], [0, 2 * y, 0]),
                   quad([-x, y, z], [2 * x, 0, 0], [0, 0, -2 * z]),
                   quad([-x, -y, -z], [2 * x, 0, 0], [0, 0, 2 * z])])


def grid(columns, rows, place):
    """A closed surface from place(u, v) -> (position, normal)."""
    positions, normals, indices = [], [], []
    for row in range(rows + 1):
        for column in range(columns + 1):
            position, normal = place(column / columns, row / rows)
            positions.append(position)
            normals.append(normal)
    for row in range(rows):
        for column in range(columns):
            a = row * (columns + 1) + column
            b = a + columns + 1
            for corners in ((a, a + 1, b + 1), (a, b + 1, b)):
                places = {tuple(round(x, 9) for x in positions[i]) for i in corners}
                if len(places) == 3:  # no triangle of a pole
                    indices += corners
    return positions, normals, [], indices


def sphere(radius, columns, rows):
    def place(u, v):
        around, down = 2 * math.pi * u, math.pi * (1 - v)
        n = [math.sin(down) * math.sin(around), math.cos(down), math.sin(down) * math.cos(around)]
        return [radius * x for x in n], n
    return grid(columns, rows, place)


def ring(radius, tube_width, height, columns, rows):
    """A band with a rounded profile, its axis along y."""
    def place(u, v):
        around, turn = 2 * math.pi * u, 2 * math.pi * v
        out, up = math.cos(turn), math.sin(turn)
        at = radius + tube_width * out
        n = [out / tube_width, up / height]
        length = math.hypot(*n)
        n = [x / length for x in n]
        return ([at * math.sin(around), height * up, at * math.cos(around)],
                [n[0] * math.sin(around), n[1], n[0] * math.cos(around)])
    return grid(columns, rows, place)


def pbr(color, metallic, roughness, texture=None):
    entry = {"baseColorFactor": [*color, 1], "metallicFactor": metallic,
             "roughnessFactor": roughness}
    if texture is not None:
        entry["baseColorTexture"] = texture
    return entry


def look(eye, to):
    """A quaternion that turns -z from `eye` to `to`, with y up."""
    z = [eye[i] - to[i] for i in range(3)]
    length = math.sqrt(sum(v * v for v in z))
    z = [v / length for v in z]
    yaw = math.atan2(z[0], z[2])
    pitch = -math.asin(z[1])
    cy, sy, cp, sp = (math.cos(yaw / 2), math.sin(yaw / 2), math.cos(pitch / 2),
                      math.sin(pitch / 2))
    return [round(v, 9) for v in (cy * sp, sy * cp, -sy * sp, cy * cp)]


def still_life():
    d = Document()
    matte = {"KHR_materials_ior": {"ior": 1}}
    d.json["images"] = [{"uri": "textures/bricks.png"}]
    d.json["samplers"] = [{"wrapS": 10497, "wrapT": 33648}]
    d.json["textures"] = [{"source": 0, "sampler": 0}]
    floor = d.add("materials", {"name": "floor", "extensions": matte,
                                "pbrMetallicRoughness": pbr([0.75, 0.72, 0.68], 0, 1)})
    bricks = d.add("materials", {
        "name": "bricks", "extensions": matte,
        "pbrMetallicRoughness": pbr(
            [0.9, 0.85, 0.8], 0, 1,
            {"index": 0, "extensions": {"KHR_texture_transform": {
                "scale": [2.4, 1.6], "rotation": 0.2}}})})
    wall = d.add("materials", {"name": "wall", "extensions": matte,
                               "pbrMetallicRoughness": pbr([0.7, 0.72, 0.75], 0, 1)})
    glass = d.add("materials", {
        "name": "glass", "pbrMetallicRoughness": pbr([1, 1, 1], 0, 0),
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1},
                       "KHR_materials_volume": {"thicknessFactor": 1}}})
    green = d.add("materials", {
        "name": "bottle green", "pbrMetallicRoughness": pbr([1, 1, 1], 0, 0.35),
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1},
                       "KHR_materials_ior": {"ior": 1.45},
                       "KHR_materials_volume": {"thicknessFactor": 0.5,
                                                "attenuationDistance": 0.5,
                                                "attenuationColor": [0.2, 0.75, 0.35]}}})
    brass = d.add("materials", {"name": "brass",
                                "pbrMetallicRoughness": pbr([0.91, 0.72, 0.38], 1, 0.12)})
    lacquer = d.add("materials", {"name": "lacquer",
                                  "pbrMetallicRoughness": pbr([0.55, 0.04, 0.03], 0, 0.1)})
    clay = d.add("materials", {"name": "clay",
                               "pbrMetallicRoughness": pbr([0.6, 0.35, 0.2], 0.4, 0.5)})
    lamp = d.add("materials", {
        "name": "lamp", "emissiveFactor": [1, 0.85, 0.6],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 6}}})

    d.node({"name": "floor",
            "mesh": d.mesh("floor", quad([-3, 0, 3], [6, 0, 0], [0, 0, -6], 3), floor)})
    d.node({"name": "back wall",
            "mesh": d.mesh("back wall", quad([-3, 0, -3], [6, 0, 0], [0, 4, 0], 2), bricks)})
    walls = joined([quad([-3, 0, 3], [0, 0, -6], [0, 4, 0]),
                    quad([3, 0, -3], [0, 0, 6], [0, 4, 0]),
                    quad([-3, 4, -3], [6, 0, 0], [0, 0, 6])])
    d.node({"name": "walls", "mesh": d.mesh("walls", walls, wall)})
    d.node({"name": "ball", "translation": [-0.75, 0.6, 0.5],
            "mesh": d.mesh("ball", sphere(0.6, 96, 64), glass)})
    d.node({"name": "ring", "translation": [0.75, 0.22, 1.2],
            "mesh": d.mesh("ring", ring(0.55, 0.04, 0.2, 128, 24), brass)})
    d.node({"name": "block", "translation": [0.9, 0.6, -0.9],
            "rotation": [0, round(math.sin(0.2), 9), 0, round(math.cos(0.2), 9)],
            "mesh": d.mesh("block", box([0.45, 0.6, 0.45]), lacquer)})
    d.node({"name": "green block", "translation": [-1.9, 0.35, -0.8],
            "rotation": [0, round(math.sin(-0.3), 9), 0, round(math.cos(-0.3), 9)],
            "mesh": d.mesh("green block", box([0.35, 0.35, 0.35]), green)})
    beads = d.mesh("bead", sphere(0.12, 32, 20), clay)
    places, sizes = [], []
    for i in range(7):
        angle = -0.9 + 0.3 * i
        places += [2.4 * math.sin(angle) * 0.9, 0.12 * (1 + 0.1 * i), 2.3 - 0.5 * math.cos(angle)]
        sizes += [1 + 0.1 * i] * 3
    d.node({"name": "beads", "mesh": beads,
            "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {
                "TRANSLATION": d.accessor(places, "VEC3"),
                "SCALE": d.accessor(sizes, "VEC3")}}}})
    d.node({"name": "lamp", "mesh": d.mesh(
        "lamp", quad([-2.4, 3.6, -2], [1.4, 0, 0], [0, 0, 1.4]), lamp)})
    d.json["extensions"] = {"KHR_lights_punctual": {"lights": [
        {"type": "spot", "name": "spot", "intensity": 683 * 40, "color": [1, 0.97, 0.9],
         "spot": {"innerConeAngle": 0.36, "outerConeAngle": 0.44}}]}}
    eye = [2.2, 3.6, 2.4]
    d.node({"name": "spot", "translation": eye, "rotation": look(eye, [0, 0.3, 0.8]),
            "extensions": {"KHR_lights_punctual": {"light": 0}}})
    d.json["cameras"] = [{"type": "perspective", "name": "camera",
                          "perspective": {"yfov": 0.62, "aspectRatio": 1.5, "znear": 0.1}}]
    eye = [0.1, 2.3, 6.6]
    d.node({"name": "camera", "translation": eye, "rotation": look(eye, [-0.05, 0.85, 0]),
            "camera": 0})
    d.use()
    return d


def png(width, height, pixels):
    def chunk(name, data):
        return (struct.pack(">I", len(data)) + name + data +
                struct.pack(">I", zlib.crc32(name + data)))
    rows = b"".join(b"\0" + pixels[4 * width * y:4 * width * (y + 1)] for y in range(height))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def seed():
    """Nearly everything that is read, as small as it can be."""
    d = Document()
    pixels = bytes([255, 128, 0, 255, 0, 255, 128, 100, 128, 0, 255, 255, 255, 255, 255, 0])
    d.json["images"] = [{"bufferView": d.view(png(2, 2, pixels)), "mimeType": "image/png"},
                        {"uri": "data:image/png;base64," +
                                base64.b64encode(png(1, 1, bytes([10, 90, 200, 255]))).decode()},
                        {"uri": "tiles.png"}]
    d.json["samplers"] = [{"wrapS": 33648, "wrapT": 33071}]
    d.json["textures"] = [{"source": 0, "sampler": 0}, {"source": 1}, {"source": 2}]
    d.json["materials"] = [
        {"name": "a", "pbrMetallicRoughness": {
            "baseColorFactor": [1, 0.5, 0.5, 0.9], "metallicFactor": 0.5, "roughnessFactor": 0.5,
            "baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": {
                "offset": [0.1, 0.2], "rotation": 1, "scale": [2, 3]}}},
            "metallicRoughnessTexture": {"index": 0}},
         "normalTexture": {"index": 1, "scale": 0.5}, "alphaMode": "MASK", "alphaCutoff": 0.4,
         "extensions": {"KHR_materials_transmission": {
             "transmissionFactor": 0.5, "transmissionTexture": {"index": 2}}}},
        {"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.2,
                                  "baseColorFactor": [0.9, 1, 1, 1]},
         "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1},
                        "KHR_materials_ior": {"ior": 1.4},
                        "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 2,
                                                 "attenuationColor": [1, 0.5, 0.2]}}},
        {"emissiveFactor": [1, 0.5, 0.2], "emissiveTexture": {"index": 0}, "doubleSided": True,
         "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 3}}},
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "alphaMode": "BLEND"}]
    positions = d.accessor([0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0], "VEC3")
    normals = d.accessor([0, 0, 127] * 4, "VEC3", 5120)
    d.json["accessors"][normals]["normalized"] = True
    uvs = d.accessor([0, 0, 1, 0, 0, 1, 1, 1], "VEC2")
    indices = d.accessor([0, 1, 2, 3], "SCALAR", 5121)
    sparse = d.view(struct.pack("<2H", 1, 2))
    values = d.view(struct.pack("<6f", 2, 0, 0, 0, 2, 0))
    d.json["accessors"].append({
        "bufferView": d.json["accessors"][positions]["bufferView"], "componentType": 5126,
        "count": 4, "type": "VEC3",
        "sparse": {"count": 2, "indices": {"bufferView": sparse, "componentType": 5123},
                   "values": {"bufferView": values}}})
    whole = {"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs}
    d.json["meshes"] = [
        {"primitives": [{"attributes": whole, "indices": indices, "mode": 5, "material": 0},
                        {"attributes": {"POSITION": len(d.json["accessors"]) - 1}, "mode": 6,
                         "material": 1}]},
        {"primitives": [{"attributes": whole, "mode": 5, "material": 2}, {"attributes": whole},
                        {"attributes": whole, "material": 3}]}]
    turns = d.accessor([0, 0, 0, 1, 0, 0, 1, 0], "VEC4")
    moves = d.accessor([0, 0, 1, 0, 0, 2], "VEC3")
    d.json["cameras"] = [
        {"type": "perspective", "perspective": {"yfov": 1, "aspectRatio": 1.5, "znear": 0.1}},
        {"type": "orthographic", "orthographic": {"xmag": 2, "ymag": 1, "znear": 0, "zfar": 9}}]
    d.json["nodes"] = [
        {"children": [1, 2], "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1]},
        {"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {
            "attributes": {"TRANSLATION": moves, "ROTATION": turns}}}},
        {"mesh": 1, "translation": [1, 0, 0], "rotation": [0, 0.6, 0, 0.8], "scale": [2, 1, 1]},
        {"camera": 0, "translation": [0, 0, 5],
         "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"camera": 1, "extensions": {"KHR_lights_punctual": {"light": 1}}},
        {"extensions": {"KHR_lights_punctual": {"light": 2}}}]
    d.json["scenes"] = [{"nodes": [0, 3, 4, 5]}]
    d.json["extensions"] = {"KHR_lights_punctual": {"lights": [
        {"type": "point", "color": [1, 0.5, 0.5], "intensity": 100},
        {"type": "spot", "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}, "range": 5},
        {"type": "directional", "intensity": 683}]}}
    d.use()
    return d


def skinned_seed():
    """A mesh with a skin and morph targets, and one with the mesh's own weights."""
    d = Document()
    positions = d.accessor([0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0], "VEC3")
    normals = d.accessor([0, 0, 1] * 4, "VEC3")
    attributes = {"POSITION": positions, "NORMAL": normals}
    joints = d.accessor([0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 9], "VEC4", 5121)
    weights = d.accessor([0.5, 0.25, 0, 0] + [1, 0, 0, 0] * 2 + [0, 0, 0, 0], "VEC4")
    up = d.accessor([0, 0, 1] * 4, "VEC3")
    nothing = d.add("accessors", {"componentType": 5126, "count": 4, "type": "VEC3"})
    identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
    binds = d.accessor(identity[:12] + [0, 0, 3, 1] + identity, "MAT4")
    targets = [{"POSITION": up, "NORMAL": up}, {"POSITION": nothing}]
    skin = {"JOINTS_0": joints, "WEIGHTS_0": weights, "JOINTS_1": joints, "WEIGHTS_1": weights}
    d.json["meshes"] = [
        {"primitives": [{"attributes": {**attributes, **skin}, "mode": 5, "targets": targets}],
         "weights": [0.5, 1]}]
    d.json["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}]
    d.json["nodes"] = [
        {"mesh": 0, "skin": 0, "weights": [0.25, 0]}, {"mesh": 0, "translation": [2, 0, 0]},
        {"children": [3], "extensions": {"KHR_node_visibility": {"visible": False}}},
        {"rotation": [0, 0.6, 0, 0.8], "mesh": 0}, {"camera": 0, "translation": [0, 0, 5]}]
    d.json["skins"] = [{"joints": [3, 2], "inverseBindMatrices": binds}]
    d.json["scenes"] = [{"nodes": [0, 1, 2, 4]}]
    d.json["extensionsUsed"] = ["KHR_node_visibility"]
    return d


def write_text_seed(path, document):
    """With the buffer within the text, and no spaces."""
    document.text("data:application/octet-stream;base64," + base64.b64encode(document.buffer).decode())
    path.write_bytes(json.dumps(document.json, separators=(",", ":")).encode())


def main():
    tests = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else
                         pathlib.Path(__file__).resolve().parent.parent)
    scene = still_life()
    (tests / "scenes/meshes/still-life.bin").write_bytes(scene.buffer)
    (tests / "scenes/still-life.gltf").write_bytes(scene.text("meshes/still-life.bin"))
    seeds = tests / "fuzz/seeds/gltf"
    seeds.mkdir(parents=True, exist_ok=True)
    small = seed()
    (seeds / "whole.glb").write_bytes(small.glb())
    write_text_seed(seeds / "whole.gltf", small)
    write_text_seed(seeds / "skinned.gltf", skinned_seed())


if __name__ == "__main__":
    main()
