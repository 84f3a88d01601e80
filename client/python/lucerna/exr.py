"""EXR files as Lucerna writes them, and a little more, into arrays.

A single part of scanlines, not compressed or by ZIPS or ZIP, with channels of 16- or 32-bit floats or
32-bit integers. Sizes are checked before memory is taken; other files are refused with a sentence.
"""

import os
import pathlib
import struct
import zlib

import numpy as np
from numpy.typing import NDArray

from lucerna.errors import Error
from lucerna.image import Image

_MAGIC = 20000630
_TILED, _DEEP, _MULTI_PART = 0x200, 0x800, 0x1000
_LONGEST_NAME = 255
_PIXEL_TYPES: dict[int, np.dtype] = {0: np.dtype("<u4"), 1: np.dtype("<f2"), 2: np.dtype("<f4")}
# Lines of a block: none, ZIPS, ZIP.
_BLOCK_LINES = {0: 1, 2: 1, 3: 16}
_MAX_PIXELS = 1 << 28
# As the programs do: a small file must not fill the memory.
_SAMPLES_OF_ANY_FILE = 1 << 30
_SAMPLES_PER_BYTE = 64


class _Reader:
    """Takes values off the front of bytes that may end anywhere."""

    def __init__(self, content: bytes, at: int = 0):
        self.content = content
        self.at = at

    def take(self, size: int) -> bytes:
        if size < 0 or size > len(self.content) - self.at:
            raise Error("not a usable EXR file: it is cut off")
        taken = self.content[self.at:self.at + size]
        self.at += size
        return taken

    def numbers(self, form: str) -> tuple[int, ...]:
        return struct.unpack("<" + form, self.take(struct.calcsize("<" + form)))

    def text(self) -> bytes:
        end = self.content.find(b"\0", self.at, self.at + _LONGEST_NAME + 1)
        if end < 0:
            raise Error("not a usable EXR file: it is cut off")
        text = self.content[self.at:end]
        self.at = end + 1
        return text


def _channels_of(attribute: bytes) -> list[tuple[str, np.dtype]]:
    reader = _Reader(attribute)
    channels = []
    while name := reader.text():
        pixel_type, _, x_sampling, y_sampling = reader.numbers("iIii")
        if pixel_type not in _PIXEL_TYPES or (x_sampling, y_sampling) != (1, 1):
            raise Error(f"not a usable EXR file: its channel {name!r} is subsampled or of an "
                        "unknown type")
        channels.append((name.decode("utf-8", "surrogateescape"), _PIXEL_TYPES[pixel_type]))
    if not channels:
        raise Error("not a usable EXR file: it has no channels")
    return channels


def _unpack(packed: bytes, size: int) -> bytes:
    """A block of ZIP or ZIPS: differences of bytes, the even ones before the odd ones."""
    stream = zlib.decompressobj()
    try:
        content = stream.decompress(packed, size + 1)
    except zlib.error:
        content = b""
    if len(content) != size or not stream.eof:
        raise Error("not a usable EXR file: a block of its scanlines is damaged")
    differences = np.frombuffer(content, dtype=np.uint8).copy()
    differences[1:] += 128
    sums = np.cumsum(differences, dtype=np.uint8)
    plain = np.empty(size, dtype=np.uint8)
    plain[0::2] = sums[:(size + 1) // 2]
    plain[1::2] = sums[(size + 1) // 2:]
    return plain.tobytes()


def decode_exr(content: bytes) -> Image:
    """The image in the bytes of an EXR file. Errors: Error."""
    reader = _Reader(content)
    magic, version = reader.numbers("II")
    if magic != _MAGIC:
        raise Error("not a usable EXR file: it does not begin like one")
    if version & (_TILED | _DEEP | _MULTI_PART):
        raise Error("not a usable EXR file: tiled, deep and multi-part files are not read; save a "
                    "single flat part of scanlines")
    metadata: dict[str, str] = {}
    channels: list[tuple[str, np.dtype]] = []
    window: tuple[int, ...] = (0, 0, -1, -1)
    compression = -1
    while name := reader.text():
        kind = reader.text()
        (size,) = reader.numbers("i")
        attribute = reader.take(size)
        if name == b"channels":
            channels = _channels_of(attribute)
        elif name == b"dataWindow":
            window = _Reader(attribute).numbers("iiii")
        elif name == b"compression":
            (compression,) = _Reader(attribute).numbers("B")
        elif kind == b"string":
            metadata[name.decode("utf-8", "surrogateescape")] = attribute.decode(
                "utf-8", "surrogateescape")
    if compression not in _BLOCK_LINES:
        raise Error("not a usable EXR file: its compression is not none, ZIPS or ZIP")
    width = window[2] - window[0] + 1
    height = window[3] - window[1] + 1
    if width <= 0 or height <= 0 or not channels:
        raise Error("not a usable EXR file: it has no pixels")
    most_samples = max(_SAMPLES_OF_ANY_FILE, _SAMPLES_PER_BYTE * len(content))
    if width * height > _MAX_PIXELS or width * height * len(channels) > most_samples:
        raise Error(f"not a usable EXR file: {width} x {height} pixels of {len(channels)} channels "
                    "are too many for its size")
    pixels = _pixels(reader, window, channels, compression)
    return Image(pixels, metadata)


def _pixels(reader: _Reader, window: tuple[int, ...], channels: list[tuple[str, np.dtype]],
            compression: int) -> dict[str, NDArray[np.float32]]:
    width = window[2] - window[0] + 1
    height = window[3] - window[1] + 1
    lines = _BLOCK_LINES[compression]
    blocks = (height + lines - 1) // lines
    # Refuses a file that is too short for its own table, before memory is taken.
    offsets = reader.numbers(f"{blocks}Q")
    planes = {name: np.empty((height, width), dtype=np.float32) for name, _ in channels}
    line_bytes = width * sum(kind.itemsize for _, kind in channels)
    for block, offset in enumerate(offsets):
        row = block * lines
        count = min(lines, height - row)
        at = _Reader(reader.content, offset)
        first_line, packed_bytes = at.numbers("ii")
        packed = at.take(packed_bytes)
        plain_bytes = line_bytes * count
        if first_line != window[1] + row or packed_bytes > plain_bytes or (
                compression == 0 and packed_bytes != plain_bytes):
            raise Error("not a usable EXR file: a block of its scanlines is damaged")
        # What does not get smaller is not packed.
        plain = packed if packed_bytes == plain_bytes else _unpack(packed, plain_bytes)
        start = 0
        for line in range(row, row + count):
            for name, kind in channels:
                planes[name][line] = np.frombuffer(plain, dtype=kind, count=width, offset=start)
                start += width * kind.itemsize
    return planes


def read_image(path: str | os.PathLike[str]) -> Image:
    """The image in an EXR file. Errors: OSError; Error, with the file's name."""
    try:
        return decode_exr(pathlib.Path(path).read_bytes())
    except Error as error:
        raise Error(f"{os.fspath(path)}: {error}") from None
