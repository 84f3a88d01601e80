"""What comes out of a render: layers of pixels as arrays, and what is known about them."""

import hashlib
import struct
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

# Keys that begin so tell of one run, and are not in the digest.
_RUN_PREFIX = "lucerna.run."
# The order of components in an array; other names follow, sorted.
_ORDER = {name: place for place, name in enumerate("RGBAXYZ")}
_BEAUTY = "beauty"


def _split(channel: str) -> tuple[str, str]:
    """Layer and component of a channel: "direct.R" is ("direct", "R"), "R" is ("beauty", "R")."""
    layer, dot, component = channel.rpartition(".")
    if dot:
        return layer, component
    return (_BEAUTY, channel) if channel in ("R", "G", "B", "A") else (channel, "")


class Image(Mapping[str, NDArray[np.float32]]):
    """Layers by name. Arrays are [height, width], or [height, width, components] of layers with
    components; row 0 is the top of the image. `image["beauty"]` is the image itself, red, green and
    blue; the others are named as in the manual: direct, photons, albedo, N, Z, radius,
    photon_count, noise, bias."""

    def __init__(self, channels: Mapping[str, NDArray[np.float32]],
                 metadata: Mapping[str, str] | None = None):
        """`channels` as the EXR file names them ("R", "direct.G", "N.X", "Z"), all of one shape."""
        # By name, as they are in a file.
        self.channels: dict[str, NDArray[np.float32]] = {
            name: np.ascontiguousarray(channels[name], dtype=np.float32)
            for name in sorted(channels, key=_bytes)}
        # The text attributes of the file: scene digest, settings, seed, passes, photons and so on.
        self.metadata: dict[str, str] = dict(metadata or {})
        shapes = {pixels.shape for pixels in self.channels.values()}
        if len(shapes) != 1 or len(next(iter(shapes))) != 2:
            raise ValueError("an image has channels of two dimensions, all of the same size")
        self.height, self.width = next(iter(shapes))
        self._layers: dict[str, list[str]] = {}
        for name in self.channels:
            self._layers.setdefault(_split(name)[0], []).append(name)
        for names in self._layers.values():
            names.sort(key=lambda name: (_ORDER.get(_split(name)[1], len(_ORDER)), name))

    def __getitem__(self, layer: str) -> NDArray[np.float32]:
        names = self._layers[layer]
        if len(names) == 1:
            return self.channels[names[0]]
        return np.stack([self.channels[name] for name in names], axis=-1)

    def __iter__(self) -> Iterator[str]:
        return iter(self._layers)

    def __len__(self) -> int:
        return len(self._layers)

    def __repr__(self) -> str:
        return f"<Image {self.width}x{self.height}: {', '.join(self)}>"

    # As objects: two images with equal layers are compared by their digests.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    def digest(self) -> str:
        """The digest that `lucerna digest` prints of the file: equal digests, equal bits."""
        stream = hashlib.sha256()

        def add(content: bytes) -> None:
            stream.update(struct.pack("<Q", len(content)))
            stream.update(content)

        add(b"lucerna image 1")
        stream.update(struct.pack("<QQQ", self.width, self.height, len(self.channels)))
        for name, pixels in self.channels.items():
            add(_bytes(name))
            add(pixels.astype("<f4", copy=False).tobytes())
        for key in sorted(self.metadata, key=_bytes):
            if not key.startswith(_RUN_PREFIX):
                add(_bytes(key))
                add(_bytes(self.metadata[key]))
        return stream.hexdigest()


def _bytes(text: str) -> bytes:
    # As the file has them, also where they are not UTF-8.
    return text.encode("utf-8", "surrogateescape")
