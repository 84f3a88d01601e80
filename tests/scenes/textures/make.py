#!/usr/bin/env python3
"""Makes the pictures that scenes of tests/scenes show: python3 make.py, in this folder."""

import math
import struct
import zlib


def write_png(path, width, height, pixel):
    rows = b"".join(
        b"\0" + bytes(value for x in range(width) for value in pixel(x, y)) for y in range(height)
    )

    def chunk(name, data):
        body = name + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header))
        file.write(chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def brick(x, y):
    """Bricks in two layers; the red corner at the top left tells up from down."""
    if x < 6 and y < 6:
        return (255, 30, 20)
    shift = 0 if y < 16 else 16
    if y % 16 == 0 or (x + shift) % 32 == 0:
        return (200, 195, 185)
    return (150 + (7 * x + 3 * y) % 16, 80, 60)


def screen(x, y):
    """A test card: six columns of colours, a white frame at the left and top, a grey foot."""
    if x < 2 or y < 2:
        return (255, 255, 255)
    if y >= 28:
        return (4 * (x + 1) - 1,) * 3
    return [(220, 30, 20), (20, 200, 40), (30, 60, 230), (230, 200, 20), (0, 0, 0), (250, 90, 200)][
        min(5, x * 6 // 64)
    ]


def direction(u, v):
    """The equal-area octahedral map from the unit square to directions."""
    u, v = 2 * u - 1, 2 * v - 1
    to_horizon = 1 - abs(u) - abs(v)
    radius = 1 - abs(to_horizon)
    quarter = 1 if radius == 0 else (abs(v) - abs(u)) / radius + 1
    phi = quarter * math.pi / 4
    across = radius * math.sqrt(2 - radius * radius)
    return (
        math.copysign(math.cos(phi), u) * across,
        math.copysign(math.sin(phi), v) * across,
        math.copysign(1 - radius * radius, to_horizon),
    )


def sky(x, y, size):
    """Blue above, brown below, and a warm sun in one pixel."""
    z = direction((x + 0.5) / size, (y + 0.5) / size)[2]
    if (x, y) == (9, 10):
        return (90.0, 75.0, 50.0)
    if z < 0:
        return (0.10, 0.08, 0.06)
    return (0.25 + 0.1 * z, 0.35 + 0.15 * z, 0.5 + 0.3 * z)


def write_pfm(path, size, pixel):
    with open(path, "wb") as file:
        file.write(f"PF\n{size} {size}\n-1.0\n".encode())
        for y in reversed(range(size)):  # a PFM begins at the bottom
            for x in range(size):
                file.write(struct.pack("<fff", *pixel(x, y, size)))


write_png("bricks.png", 32, 32, brick)
write_png("screen.png", 64, 36, screen)
write_pfm("sky.pfm", 16, sky)
