#!/usr/bin/env python3
"""Where do the meshes and the smoke of tests/scenes come from?

Writes meshes/water.ply.gz and meshes/cup.ply.gz beside the scenes: binary PLY with vertex normals
taken from the formulas, not from the triangles; and densities/smoke.pbrt.gz, a medium. Running it
again gives the same bytes (zlib willing).

  tests/tools/make_scene_meshes.py
"""
import gzip
import math
import pathlib
import struct

SCENES = pathlib.Path(__file__).resolve().parent.parent / "scenes"
MESHES = SCENES / "meshes"
DENSITIES = SCENES / "densities"

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


def smoke_at(x, y, z):
    """A plume [m] that rises from the origin to 1.6, winds, widens and folds."""
    sway = 0.05 + 0.10 * z
    across = x - sway * math.sin(3.1 * z)
    away = y - 0.7 * sway * math.sin(4.3 * z + 0.8)
    radius = 0.05 + 0.13 * z
    # Rolls that grow with the height.
    angle = math.atan2(away, across)
    radius *= 1 + 0.35 * min(z, 1) * math.sin(11 * z - 2 * angle) * math.cos(7 * z + angle)
    distance = math.hypot(across, away) / radius
    folds = 0.55 + 0.45 * math.sin(9 * distance - 13 * z + angle)
    ends = min(1, 12 * z) * min(1, max(0, 4 * (1.6 - z)))
    return max(0.0, math.exp(-distance**2) - 0.05) * folds * ends / (0.4 + z)


def write_smoke(cells, height_cells, half_width, height):
    values = []
    for k in range(height_cells):
        for j in range(cells):
            for i in range(cells):
                x, y = ((2 * n + 1) / cells * half_width - half_width for n in (i, j))
                values.append(f"{smoke_at(x, y, height * (k + 0.5) / height_cells):.3f}")
    values = ["0" if value == "0.000" else value.lstrip("0") for value in values]
    rows = "\n".join(" ".join(values[i:i + cells]) for i in range(0, len(values), cells))
    text = ('# Written by tests/tools/make_scene_meshes.py\n'
            'MakeNamedMedium "smoke" "string type" ["uniformgrid"]\n'
            '  "rgb sigma_a" [0.6 0.7 0.8] "rgb sigma_s" [7 6.9 6.6] "float g" [0.4]\n'
            f'  "integer nx" [{cells}] "integer ny" [{cells}] "integer nz" [{height_cells}]\n'
            f'  "point3 p0" [{-half_width} {-half_width} 0]'
            f' "point3 p1" [{half_width} {half_width} {height}]\n'
            f'  "float density" [\n{rows}\n]\n')
    DENSITIES.mkdir(exist_ok=True)
    (DENSITIES / "smoke.pbrt.gz").write_bytes(gzip.compress(text.encode(), 9, mtime=0))


if __name__ == "__main__":
    write_smoke(cells=36, height_cells=64, half_width=0.5, height=1.65)
    write("water.ply.gz", water(size=1.2, cells=96))
    write("cup.ply.gz", cup(radius=0.5, height=0.3, half_angle=math.radians(115), sides=1800))
