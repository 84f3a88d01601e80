#!/usr/bin/env python3
"""Where do the meshes of tests/scenes come from?

Writes meshes/water.ply.gz and meshes/cup.ply.gz beside the scenes: binary PLY with vertex normals
taken from the formulas, not from the triangles. Running it again gives the same bytes (zlib willing).

  tests/tools/make_scene_meshes.py
"""
import gzip
import math
import pathlib
import struct

MESHES = pathlib.Path(__file__).resolve().parent.parent / "scenes" / "meshes"

# Height waves [m]: amplitude, length, direction [degrees], phase. No two run alike, so that the
# crests cross and the light on the floor closes into cells.
WAVES = [
    (0.0072, 0.47, 12, 0.4),
    (0.0064, 0.41, 74, 2.1),
    (0.0052, 0.36, 131, 4.4),
    (0.0042, 0.31, 40, 1.2),
    (0.0034, 0.27, 158, 5.5),
]


def water(size, cells):
    """A square of waves around z = 0, seen from above."""
    vertices = []
    for j in range(cells + 1):
        for i in range(cells + 1):
            x, y = size * (i / cells - 0.5), size * (j / cells - 0.5)
            z = slope_x = slope_y = 0.0
            for amplitude, length, degrees, phase in WAVES:
                k = 2 * math.pi / length
                kx, ky = k * math.cos(math.radians(degrees)), k * math.sin(math.radians(degrees))
                angle = kx * x + ky * y + phase
                z += amplitude * math.sin(angle)
                slope_x += amplitude * kx * math.cos(angle)
                slope_y += amplitude * ky * math.cos(angle)
            norm = math.sqrt(1 + slope_x**2 + slope_y**2)
            vertices.append((x, y, z, -slope_x / norm, -slope_y / norm, 1 / norm))
    faces = []
    for j in range(cells):
        for i in range(cells):
            a = j * (cells + 1) + i
            b, c, d = a + 1, a + cells + 2, a + cells + 1
            faces += [(a, b, c), (a, c, d)]
    return vertices, faces


def cup(radius, height, half_angle, sides):
    """A part of an upright tube around the z axis that faces inward; its middle is at +x."""
    vertices = []
    for i in range(sides + 1):
        angle = half_angle * (2 * i / sides - 1)
        x, y = math.cos(angle), math.sin(angle)
        for z in (0.0, height):
            vertices.append((radius * x, radius * y, z, -x, -y, 0.0))
    faces = []
    for i in range(sides):
        a, b = 2 * i, 2 * (i + 1)
        faces += [(a, b + 1, b), (a, a + 1, b + 1)]
    return vertices, faces


def write(name, mesh):
    vertices, faces = mesh
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\n"
        + "".join(f"property float {p}\n" for p in ("x", "y", "z", "nx", "ny", "nz"))
        + f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    body = b"".join(struct.pack("<6f", *v) for v in vertices)
    body += b"".join(struct.pack("<B3i", 3, *f) for f in faces)
    MESHES.mkdir(exist_ok=True)
    (MESHES / name).write_bytes(gzip.compress(header.encode() + body, 9, mtime=0))


if __name__ == "__main__":
    write("water.ply.gz", water(size=1.2, cells=96))
    write("cup.ply.gz", cup(radius=0.5, height=0.3, half_angle=math.radians(115), sides=1800))
